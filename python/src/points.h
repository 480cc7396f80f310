// SPDX-License-Identifier: MIT
// Points as arrays. firn/_points.py has brought them to float64 in C's order before, and checked their
// shapes.
#pragma once
#include <pybind11/pybind11.h>

#include "firn/points.h"

namespace firn::python {

Points points_of(const pybind11::dict& columns);

void bind_points(pybind11::module_& module);

}  // namespace firn::python
