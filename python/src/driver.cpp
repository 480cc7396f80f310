// SPDX-License-Identifier: MIT
#include "python/src/driver.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "python/src/values.h"

namespace firn::python {
namespace {

py::tuple fields_of(const DrivenCollider& c) {
  return py::make_tuple(c.name, c.time, array_of(c.position), array_of(c.rotation), array_of(c.velocity),
                        array_of(c.angular_velocity), c.dt, array_of(c.force), array_of(c.torque));
}

// Its last copy may go in any thread.
struct Function {
  py::function call;
  ~Function() {
    const py::gil_scoped_acquire locked;
    call = {};
  }
};

Matrix3 rows_of(const py::handle& value) {
  const auto array = value.cast<py::array_t<double, py::array::c_style | py::array::forcecast>>();
  if (array.ndim() != 2 || array.shape(0) != 3 || array.shape(1) != 3)
    throw py::value_error("the rotation of a driven collider has the shape (3, 3)");
  Matrix3 rows;
  std::copy_n(array.data(), rows.size(), rows.begin());
  return rows;
}

DrivenCollider collider_of(const py::handle& c) {
  const auto vector = [&](const char* name) { return c.attr(name).cast<Vector3>(); };
  return {c.attr("name").cast<std::string>(),
          c.attr("time").cast<double>(),
          vector("position"),
          rows_of(c.attr("rotation")),
          vector("velocity"),
          vector("angular_velocity"),
          c.attr("dt").cast<double>(),
          vector("force"),
          vector("torque")};
}

}  // namespace

ColliderDriver driver_of(const py::function& function, OneUser& user) {
  return [call = std::make_shared<Function>(Function{function}), &user](const DrivenCollider& now) {
    const py::gil_scoped_acquire locked;
    const OneUser::Guest guest(user);
    const auto [linear, angular] = call->call(*fields_of(now)).cast<std::pair<Vector3, Vector3>>();
    return ColliderVelocity{linear, angular};
  };
}

py::tuple told(const std::vector<DrivenCollider>& colliders) {
  const py::object kind = py::module_::import("firn._driver").attr("DrivenCollider");
  py::list all;
  for (const DrivenCollider& c : colliders) all.append(kind(*fields_of(c)));
  return py::tuple(all);
}

std::vector<DrivenCollider> colliders_of(const py::iterable& told) {
  std::vector<DrivenCollider> all;
  for (const py::handle c : told) all.push_back(collider_of(c));
  return all;
}

}  // namespace firn::python
