// SPDX-License-Identifier: MIT
#pragma once
#include <pybind11/pybind11.h>

#include "firn/metrics.h"

namespace firn::python {

// The fields of firn.Metrics, by their names.
pybind11::dict fields_of(const Metrics& metrics);

}  // namespace firn::python
