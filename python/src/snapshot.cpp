// SPDX-License-Identifier: MIT
// firn.Snapshot: its columns as NumPy arrays that lie in the snapshot's own memory and keep it alive.
#include "python/src/snapshot.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "firn/snapshot.h"
#include "python/src/arrays.h"
#include "python/src/driver.h"
#include "python/src/values.h"

namespace firn::python {
namespace {

constexpr py::ssize_t kMost = 0xffffffff;  // ids have 32 bits

template <class T>
py::object view(Column<T>& column, const py::object& owner) {
  const auto size = static_cast<py::ssize_t>(column.size());
  return py::array_t<T>(Shape{size}, Shape{sizeof(T)}, column.data(), owner);
}

template <class T, std::size_t width>
py::object view(Columns<T, width>& columns, const py::object& owner) {
  const auto size = static_cast<py::ssize_t>(columns.size());
  const auto row = static_cast<py::ssize_t>(columns.stride() * sizeof(T));
  return py::array_t<T>(Shape{static_cast<py::ssize_t>(width), size}, Shape{row, sizeof(T)}, columns.data(),
                        owner);
}

template <auto member>
py::object column(const py::object& self) {
  return view(self.cast<Snapshot&>().*member, self);
}

template <auto member, auto asked>
py::object column_if_asked(const py::object& self) {
  if (!(self.cast<Snapshot&>().state().*asked)) return py::none();
  return column<member>(self);
}

std::unique_ptr<Snapshot> make(py::ssize_t particles, bool F, bool Jp, bool J, bool stress) {
  if (particles < 0 || particles > kMost)
    throw py::value_error("a snapshot has 0 to " + std::to_string(kMost) + " particles");
  return std::make_unique<Snapshot>(static_cast<std::size_t>(particles), StateColumns{F, Jp, J, stress});
}

py::object world_positions(const Snapshot& snow) {
  py::array_t<double> all = new_array<double>({static_cast<py::ssize_t>(snow.size()), 3});
  double* const out = all.mutable_data();
  for (std::size_t i = 0; i < snow.size(); ++i) {
    const Vector3 x = snow.world_position(i);
    for (std::size_t k = 0; k < 3; ++k) out[3 * i + k] = x[k];
  }
  return all;
}

py::object rotation_matrix(const Snapshot& snow, py::ssize_t i) {
  const auto size = static_cast<py::ssize_t>(snow.size());
  if (i < -size || i >= size) {
    throw py::index_error("particle " + std::to_string(i) + " of a snapshot of " + std::to_string(size) +
                          (size == 1 ? " particle" : " particles"));
  }
  return array_of(snow.rotation_matrix(static_cast<std::size_t>(i < 0 ? i + size : i)));
}

std::string text_of(const Snapshot& snow) {
  return "<firn.Snapshot of " + std::to_string(snow.size()) +
         (snow.size() == 1 ? " particle" : " particles") + " at " +
         py::repr(py::float_(snow.time)).cast<std::string>() + " s>";
}

void bind_columns(py::class_<Snapshot>& snapshot) {
  snapshot
      .def_property_readonly("position", &column<&Snapshot::position>,
                             "float32, (3, N): m, relative to `origin`. Row stride: see the class.")
      .def_property_readonly("velocity", &column<&Snapshot::velocity>, "float32, (3, N): m/s.")
      .def_property_readonly("density", &column<&Snapshot::density>,
                             "float32, (N,): kg/m^3, now: mass / (volume0 * J).")
      .def_property_readonly("volume0", &column<&Snapshot::volume0>,
                             "float32, (N,): m^3, the volume that the particle was placed with.")
      .def_property_readonly(
          "rotation", &column<&Snapshot::rotation>,
          "int16, (3, N): how far the particle has rotated since it was placed, world axes: "
          "the axis times tan(angle / 4), in 1/32767. rotation_matrix() unpacks it.")
      .def_property_readonly("id", &column<&Snapshot::id>,
                             "uint32, (N,): unique, and constant for the life of a particle.")
      .def_property_readonly("object", &column<&Snapshot::object>,
                             "uint16, (N,): index of the [[snow]] table that the particle came from.")
      .def_property_readonly(
          "F", &column_if_asked<&Snapshot::F, &StateColumns::F>,
          "float32, (9, N): elastic deformation gradient, row by row, world axes; or None.")
      .def_property_readonly("Jp", &column_if_asked<&Snapshot::Jp, &StateColumns::Jp>,
                             "float32, (N,): plastic volume ratio; negative: a layer that collapses has lost "
                             "its cohesion. Or None.")
      .def_property_readonly("J", &column_if_asked<&Snapshot::J, &StateColumns::J>,
                             "float32, (N,): volume now / volume0; or None.")
      .def_property_readonly(
          "stress", &column_if_asked<&Snapshot::stress, &StateColumns::stress>,
          "float32, (9, N): Pa, Kirchhoff stress, row by row, world axes, tension positive; "
          "or None.");
}

constexpr const char* kClass =
    R"(The particles at one time, as columns of NumPy arrays.

Snapshot(particles, F=False, Jp=False, J=False, stress=False) has columns full of zeros; Simulation.snapshot()
makes those of a simulation. A snapshot is a copy: the simulation goes on without it.

A column is a view of the snapshot's memory, without a copy. It may be written to, and keeps the snapshot alive.
Columns with several values a particle have the shape (3, N) or (9, N), and their rows lie apart in memory by a
few more entries than N: column[k] is contiguous, column as a whole is so only where the strides say it.
Columns of the state (F, Jp, J, stress) are None unless they were asked for.

copy.copy() makes an independent snapshot; pickle works.)";

}  // namespace

void bind_snapshot(py::module_& module) {
  py::class_<Snapshot> snapshot(module, "Snapshot", kClass);
  snapshot
      .def(py::init(&make), py::arg("particles") = 0, py::kw_only(), py::arg("F") = false,
           py::arg("Jp") = false, py::arg("J") = false, py::arg("stress") = false,
           "Columns full of zeros for so many particles, with those of the state that are asked for.")
      .def_readwrite("frame", &Snapshot::frame, "Number of the frame; 0 from a simulation.")
      .def_readwrite("time", &Snapshot::time, "s of simulated time.")
      .def_readwrite("dx", &Snapshot::dx, "m, the simulation's grid spacing.")
      .def_property(
          "origin", [](const Snapshot& snow) { return array_of(snow.origin); },
          [](Snapshot& snow, const Vector3& origin) { snow.origin = origin; },
          "float64, (3,), constant: m, where positions are relative to. Assign a new one to change it.")
      .def_property(
          "driven", [](const Snapshot& snow) { return told(snow.driven); },
          [](Snapshot& snow, const py::iterable& driven) { snow.driven = colliders_of(driven); },
          "Where the colliders are that a program drives: a tuple of DrivenCollider, in the scene's order.")
      .def_property_readonly("size", &Snapshot::size, "Number of particles, N.")
      .def("world_positions", &world_positions,
           "A copy of the positions in the world: float64, (N, 3), m. This is `origin` + `position`.")
      .def("rotation_matrix", &rotation_matrix, py::arg("i"),
           "float64, (3, 3): how particle i has rotated since it was placed. Errors: IndexError.")
      .def("__len__", &Snapshot::size)
      .def("__copy__", [](const Snapshot& snow) { return Snapshot(snow); })
      .def("__deepcopy__", [](const Snapshot& snow, const py::dict&) { return Snapshot(snow); })
      .def("__repr__", &text_of)
      .def("__reduce__", [](const py::object& self) {
        return py::module_::import("firn._snapshot").attr("reduced")(self);
      });
  bind_columns(snapshot);
  snapshot.attr("__module__") = "firn";
}

}  // namespace firn::python
