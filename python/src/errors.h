// SPDX-License-Identifier: MIT
// firn::Error as the exceptions of the package.
#pragma once
#include <pybind11/pybind11.h>

namespace firn::python {

void bind_errors(pybind11::module_& module);

}  // namespace firn::python
