// SPDX-License-Identifier: MIT
// firn._core: the library as the Python files of the package take it. What people see of it is in these.
#include <pybind11/pybind11.h>

#include "firn/version.h"
#include "python/src/check.h"
#include "python/src/errors.h"
#include "python/src/points.h"
#include "python/src/renderer.h"
#include "python/src/scene.h"
#include "python/src/session.h"
#include "python/src/simulation.h"
#include "python/src/snapshot.h"
#include "python/src/work.h"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The library firn, for the Python files of the package.";
  firn::python::bind_errors(module);
  firn::python::bind_work(module);
  firn::python::bind_scene(module);
  firn::python::bind_check(module);
  firn::python::bind_snapshot(module);
  firn::python::bind_points(module);
  firn::python::bind_renderer(module);
  firn::python::bind_simulation(module);
  firn::python::bind_session(module);
  module.def("version", &firn::version, "\"0.2.0\"");
  module.def("revision", &firn::revision, "The commit of git, \"-dirty\" if changed, or \"unknown\".");
}
