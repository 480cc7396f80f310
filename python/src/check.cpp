// SPDX-License-Identifier: MIT
// firn::check_scene for firn/_check.py: a report as a dict of plain values.
#include "python/src/check.h"

#include <pybind11/stl.h>

#include <memory>
#include <string>

#include "firn/check.h"
#include "python/src/values.h"
#include "python/src/work.h"

namespace firn::python {
namespace {

constexpr const char* kKinds[] = {"unseen", "floating", "sparse_points", "odd_points", "buried"};

py::list snow_of(const CheckReport& report) {
  py::list all;
  for (const CheckedSnow& s : report.snow) {
    all.append(py::make_tuple(s.name, s.particles, s.mass, s.volume, s.particle_mass, array_of(s.bounds_min),
                              array_of(s.bounds_max), s.pixel_fraction));
  }
  return all;
}

py::list warnings_of(const CheckReport& report) {
  py::list all;
  for (const SceneWarning& w : report.warnings)
    all.append(py::make_tuple(kKinds[static_cast<std::size_t>(w.kind)], w.snow, w.place, w.text));
  return all;
}

py::list objects_of(const CheckReport& report) {
  py::list all;
  for (const CheckedObject& o : report.objects) all.append(py::make_tuple(o.name, o.pixel_fraction));
  return all;
}

py::dict fields_of(const CheckReport& r) {
  py::dict all;
  all["scene"] = r.scene;
  all["file"] = r.file;
  all["snow"] = snow_of(r);
  all["particles"] = r.particles;
  all["mass"] = r.mass;
  all["dx"] = r.dx;
  all["grid_blocks"] = r.grid_blocks;
  all["step"] = py::make_tuple(r.step.dt, r.step.cause);
  all["fixed_dt"] = r.fixed_dt;
  all["shortest_dt"] = r.shortest_dt;
  all["frames"] = r.frames;
  all["frame_seconds"] = r.frame_seconds;
  all["steps_per_frame"] = py::make_tuple(r.steps_per_frame.low, r.steps_per_frame.high);
  all["steps"] = py::make_tuple(r.steps.low, r.steps.high);
  all["width"] = r.width;
  all["height"] = r.height;
  all["samples"] = r.samples;
  all["max_bounces"] = r.max_bounces;
  all["warnings"] = warnings_of(r);
  all["blow_up"] = r.blow_up ? py::object(py::str(r.blow_up->what())) : py::none();
  all["memory"] = py::make_tuple(r.memory.at_start, r.memory.peak_low, r.memory.peak_high,
                                 r.memory.simulation, r.memory.bytes_per_particle);
  all["objects"] = objects_of(r);
  all["background_fraction"] = r.background_fraction;
  return all;
}

}  // namespace

void bind_check(py::module_& module) {
  module.def("check_scene", [](const Scene& scene, int threads, const std::string& isa, bool force) {
    const auto report = std::make_shared<CheckReport>();
    run_alone([report, scene, options = CheckOptions{threads, isa, force}] {
      *report = check_scene(scene, options);
    });
    return fields_of(*report);
  });
}

}  // namespace firn::python
