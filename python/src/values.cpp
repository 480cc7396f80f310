// SPDX-License-Identifier: MIT
#include "python/src/values.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "python/src/arrays.h"

namespace firn::python {
namespace {

Value::Array array_of(const py::list& values) {
  Value::Array array;
  array.reserve(values.size());
  for (const py::handle& value : values) array.push_back(value_of(value));
  return array;
}

py::object constant(py::array_t<double> array) {
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

}  // namespace

Value value_of(const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
  if (py::isinstance<py::int_>(value)) return value.cast<std::int64_t>();
  if (py::isinstance<py::float_>(value)) return value.cast<double>();
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (py::isinstance<py::dict>(value)) return table_of(value.cast<py::dict>());
  return array_of(value.cast<py::list>());
}

Table table_of(const py::dict& keys) {
  Table table;
  table.reserve(keys.size());
  for (const auto& [name, value] : keys) table.push_back({name.cast<std::string>(), value_of(value)});
  return table;
}

py::object array_of(const Vector3& vector) { return constant(array_at({3}, vector.data())); }

py::object array_of(const Matrix3& matrix) { return constant(array_at({3, 3}, matrix.data())); }

}  // namespace firn::python
