// SPDX-License-Identifier: MIT
#include "python/src/points.h"

#include <cstring>
#include <string>
#include <vector>

#include "python/src/arrays.h"

namespace firn::python {
namespace {

// Rows of doubles that lie as the array has them.
template <class Row>
void take(const py::dict& columns, const char* name, std::vector<Row>& out) {
  if (!columns.contains(name)) return;
  const auto array = columns[name].cast<py::array_t<double, py::array::c_style>>();
  out.resize(static_cast<std::size_t>(array.size()) * sizeof(double) / sizeof(Row));
  if (!out.empty()) std::memcpy(out.data(), array.data(), out.size() * sizeof(Row));
}

template <class Row>
void put(py::dict& columns, const char* name, const std::vector<Row>& rows, const Shape& shape) {
  if (rows.empty()) return;
  py::array_t<double> array = new_array<double>(shape);
  std::memcpy(array.mutable_data(), rows.data(), rows.size() * sizeof(Row));
  columns[name] = array;
}

py::dict columns_of(const Points& points) {
  const auto count = static_cast<py::ssize_t>(points.position.size());
  py::dict columns;
  put(columns, "position", points.position, {count, 3});
  put(columns, "velocity", points.velocity, {count, 3});
  put(columns, "volume", points.volume, {count});
  put(columns, "mass", points.mass, {count});
  put(columns, "radius", points.radius, {count});
  put(columns, "density", points.density, {count});
  put(columns, "Jp", points.Jp, {count});
  put(columns, "F", points.F, {count, 3, 3});
  return columns;
}

}  // namespace

Points points_of(const py::dict& columns) {
  Points points;
  take(columns, "position", points.position);
  take(columns, "velocity", points.velocity);
  take(columns, "volume", points.volume);
  take(columns, "mass", points.mass);
  take(columns, "radius", points.radius);
  take(columns, "density", points.density);
  take(columns, "Jp", points.Jp);
  take(columns, "F", points.F);
  return points;
}

void bind_points(py::module_& module) {
  module.def("read_points", [](const std::string& file) {
    Points points;
    {
      const py::gil_scoped_release unlocked;
      points = read_points(file);
    }
    return columns_of(points);
  });
  module.def("write_points", [](const py::dict& columns, const std::string& file) {
    const Points points = points_of(columns);
    const py::gil_scoped_release unlocked;
    write_points(points, file);
  });
}

}  // namespace firn::python
