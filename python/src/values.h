// SPDX-License-Identifier: MIT
// Values of scenes. firn/_values.py has brought them to Python's own types before, and checked them.
#pragma once
#include <pybind11/pybind11.h>

#include "firn/scene.h"
#include "firn/vector.h"

namespace firn::python {

namespace py = pybind11;

Value value_of(const py::handle& value);
Table table_of(const py::dict& keys);

// Constant arrays of float64, (3,) and (3, 3).
py::object array_of(const Vector3& vector);
py::object array_of(const Matrix3& matrix);

}  // namespace firn::python
