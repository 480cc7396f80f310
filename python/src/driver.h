// SPDX-License-Identifier: MIT
// Functions of Python that drive colliders, and the state that these are told.
#pragma once
#include <pybind11/pybind11.h>

#include <vector>

#include "firn/driver.h"
#include "python/src/use.h"

namespace firn::python {

namespace py = pybind11;

// The function gets the fields of firn.DrivenCollider one by one and returns a linear and an angular
// velocity. It may use what `user` guards, which must outlive the driver.
ColliderDriver driver_of(const py::function& function, OneUser& user);

// A tuple of firn.DrivenCollider, and back.
py::tuple told(const std::vector<DrivenCollider>& colliders);
std::vector<DrivenCollider> colliders_of(const py::iterable& told);

}  // namespace firn::python
