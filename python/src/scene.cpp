// SPDX-License-Identifier: MIT
#include "python/src/scene.h"

#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "firn/scene.h"
#include "python/src/points.h"
#include "python/src/values.h"

namespace firn::python {
namespace {

using Overrides = std::vector<std::pair<std::string, std::string>>;  // path, value as TOML

ReadOptions read_options(bool quick, const Overrides& overrides) {
  ReadOptions options{quick, {}};
  for (const auto& [path, value] : overrides) options.overrides.push_back({path, value});
  return options;
}

// What an override does wrong was said at a place in the program.
[[noreturn]] void throw_at(const Error& error, const std::string& place) {
  const std::string option = "--set ";
  if (error.where().compare(0, option.size(), option) != 0) throw error;
  const std::string what = std::string(error.what()).substr(error.where().size() + 2);
  throw Error(error.code(), place, "'" + error.where().substr(option.size()) + "': " + what);
}

Scene read(const std::string& file, bool quick, const Overrides& overrides, const std::string& place) {
  const py::gil_scoped_release unlocked;
  try {
    return Scene::read(file, read_options(quick, overrides));
  } catch (const Error& error) {
    throw_at(error, place);
  }
}

Scene parse(const std::string& text, const std::string& file, bool quick, const Overrides& overrides,
            const std::string& place) {
  const py::gil_scoped_release unlocked;
  try {
    return Scene::parse(text, file, read_options(quick, overrides));
  } catch (const Error& error) {
    throw_at(error, place);
  }
}

void set(Scene& scene, const std::string& path, const py::object& value, const std::string& place) {
  scene.set(path, value_of(value), Place{place});
}

void add(Scene& scene, const std::string& list, const py::dict& keys, const std::string& place) {
  scene.add(list, table_of(keys), Place{place});
}

void add_points_to(Scene& scene, const py::dict& columns, const py::dict& keys, const std::string& place) {
  scene.add_points(points_of(columns), table_of(keys), Place{place});
}

}  // namespace

void bind_scene(py::module_& module) {
  py::class_<Scene>(module, "Scene", "firn::Scene; firn.Scene is its face.")
      .def(py::init(
          [](const std::string& name, const std::string& place) { return Scene(name, Place{place}); }))
      .def_static("read", &read)
      .def_static("parse", &parse)
      .def("set", &set)
      .def("add", &add)
      .def("add_points", &add_points_to)
      .def("check", &Scene::check)
      .def("toml", &Scene::toml)
      .def("frames", &Scene::frames)
      .def("frame_time", &Scene::frame_time)
      .def("copy", [](const Scene& scene) { return Scene(scene); });
}

}  // namespace firn::python
