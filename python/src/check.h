// SPDX-License-Identifier: MIT
#pragma once
#include <pybind11/pybind11.h>

namespace firn::python {

void bind_check(pybind11::module_& module);

}  // namespace firn::python
