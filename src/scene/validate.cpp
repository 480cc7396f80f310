// SPDX-License-Identifier: MIT
#include "src/scene/validate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <map>

#include "firn/error.h"
#include "src/core/memory.h"
#include "src/scene/name.h"
#include "src/scene/suggest.h"

namespace firn {
namespace {

constexpr std::size_t kLongestName = 200;  // bytes; a folder may have 255

struct Checker {
  const SceneConfig& scene;

  bool given(const std::string& table, const std::string& key) const {
    return scene.places.count(table.empty() ? key : table + "." + key) > 0;
  }
  [[noreturn]] void refuse(const std::string& table, const std::string& key, const std::string& what) const {
    throw Error(ErrorCode::usage, place_of(scene, table, key), what);
  }
  void require_direction(const Vec3& direction, const std::string& table, const std::string& key) const {
    if (!(direction.norm() > 0)) refuse(table, key, "'" + key + "' is zero and points nowhere");
  }

  void camera() const {
    const Camera& c = scene.camera;
    if (c.position == c.target)
      refuse("camera", "target", "the camera's position and target are the same point");
    require_direction(c.up, "camera", "up");
    const Vec3 view = (c.target - c.position).normalized();
    if (view.cross(c.up.normalized()).norm() < 1e-9) {
      refuse("camera", "up", "the camera's up direction is the direction that it looks in");
    }
    if (c.focus && c.aperture == 0) {
      refuse("camera", "focus", "'focus' is given, but no 'aperture': without a lens all is sharp");
    }
    if (c.motion) camera_motion(c);
  }

  void camera_motion(const Camera& c) const {
    for (const CameraKey& key : *c.motion) {
      const Vec3 view = key.target - key.position;
      if (view.norm() > 0 && view.normalized().cross(c.up.normalized()).norm() >= 1e-9) continue;
      refuse("camera", "motion",
             "at a key frame of 'motion' the camera is at its target, or looks along 'up'");
    }
  }

  void output() const {
    const auto& formats = scene.output.formats;
    if (formats.empty())
      refuse("output", "formats",
             "no format is given, so there would be no picture; 'firn simulate' makes none");
  }

  void preview() const {
    if (scene.image.integrator != Integrator::preview) return;
    if (!scene.media.empty())
      refuse("image", "integrator",
             "'preview' does not see a [[medium]]: take \"path\" or \"bidirectional\"");
    if (scene.image.reference)
      refuse("image", "reference",
             "'reference' asks for nothing but the equations, integrator = \"preview\" for estimates: take "
             "\"path\"");
  }

  void simulation() const {
    const SimulationConfig& s = scene.simulation;
    if (s.dx && s.particles_across) {
      refuse("simulation", "particles_across",
             "both dx and particles_across are given: one follows from the other");
    }
    if (s.domain_min.has_value() != s.domain_max.has_value()) {
      const char* key = s.domain_min ? "domain_min" : "domain_max";
      refuse("simulation", key, "domain_min and domain_max are given together or not at all");
    }
    if (s.domain_min && (s.domain_min->array() >= s.domain_max->array()).any()) {
      refuse("simulation", "domain_max", "domain_max is not above domain_min in every axis");
    }
    if (!s.domain_min && !s.domain_rotation.isZero(0)) {
      refuse("simulation", "domain_rotation",
             "'domain_rotation' turns the domain's box: give domain_min and domain_max too");
    }
  }

  void moduli(const std::string& table, const SnowConfig& snow) const {
    if (snow.mu.has_value() != snow.lambda.has_value()) {
      refuse(table, snow.mu ? "mu" : "lambda", "mu and lambda are given together or not at all");
    }
    for (const char* key : {"young_modulus", "poisson_ratio"}) {
      if (snow.mu && given(table, key)) {
        refuse(table, key,
               std::string("both ") + key + " and mu, lambda are given: one follows from the other");
      }
    }
  }

  void limits(const std::string& table, const Material& m) const {
    if (m.sigma_min > m.sigma_max) refuse(table, "sigma_min", "sigma_min is above sigma_max");
    if (m.jp_min > m.jp_max) refuse(table, "jp_min", "jp_min is above jp_max");
    if (m.model == kKindOf<kernels::CamClay> && m.hardening < 0.01) {
      refuse(table, "hardening", "cam_clay has its strength by hardening: it must be at least 0.01");
    }
  }

  void shape(const std::string& table, const ShapeConfig& shape) const {
    if (shape.shape == "plane") require_direction(*shape.normal, table, "normal");
    if (shape.shape == "capsule" && *shape.height <= 2 * *shape.radius) {
      refuse(table, "height",
             "'height' of a capsule counts its round ends: it must be above twice its radius");
    }
    file(table, "file", shape.file);
  }

  void file(const std::string& table, const std::string& key, const std::optional<std::string>& path) const {
    std::error_code ignored;
    if (!path || names_arrays(*path)) return;
    if (std::filesystem::is_regular_file(*path, ignored)) {
      if (std::filesystem::file_size(*path, ignored) < machine_memory()) return;
      throw Error(ErrorCode::io, place_of(scene, table, key),
                  "this file is larger than the memory of the machine: " + *path);
    }
    if (path->empty()) refuse(table, key, "'" + key + "' names no file");
    const char* what = std::filesystem::is_directory(*path, ignored) ? "this is a folder, not a file: "
                       : std::filesystem::exists(*path, ignored) ? "this is a pipe or a device, not a file: "
                                                                 : "no such file: ";
    throw Error(ErrorCode::io, place_of(scene, table, key), what + *path);
  }

  template <class Solid>
  void friction(const std::string& table, const Solid& solid) const {
    if (!solid.static_friction || *solid.static_friction >= solid.friction) return;
    refuse(table, "static_friction",
           "'static_friction' is below 'friction': what stands holds at least as well as what slides");
  }

  // Turns take the short way, so half a turn between two keys has no direction.
  void motion(const std::string& table, const ColliderConfig& collider) const {
    if (collider.pivot && !collider.motion) {
      refuse(table, "pivot", "'pivot' is given, but no 'motion' that could turn about it");
    }
    if (!collider.motion) return;
    const auto& keys = *collider.motion;
    for (std::size_t k = 1; k < keys.size(); ++k) {
      if ((keys[k].rotation - keys[k - 1].rotation).cwiseAbs().maxCoeff() < 180) continue;
      refuse(table, "motion",
             "'motion' turns by half a turn or more between two key frames: put another one between them");
    }
  }

  void surface_name(const std::string& table, const std::string& name) const {
    std::vector<std::string> names;
    for (const Surface& surface : scene.surfaces) names.push_back(surface.name);
    if (name.empty() || std::count(names.begin(), names.end(), name) > 0) return;
    refuse(table, "surface", "no [[surface]] is named '" + name + "'" + suggestion(name, names));
  }

  template <class List>
  void names(const std::string& table, const List& list) const {
    std::map<std::string, std::size_t> seen;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string path = table_of(table, i);
      word(path, list[i].name);
      if (!seen.emplace(list[i].name, i).second) {
        refuse(path, "name", "two [[" + table + "]] are named '" + list[i].name + "'");
      }
    }
  }

  void word(const std::string& table, const std::string& name) const {
    if (!is_name(name))
      refuse(table, "name", "'" + name + "' cannot be a name: use letters, digits, _ and -");
    if (name.size() > kLongestName)
      refuse(table, "name",
             "a name may have " + std::to_string(kLongestName) + " bytes at most: run folders get it");
  }

  void quad(const std::string& table, const LightConfig& light) const {
    const int edges = light.corner.has_value() + light.edge_u.has_value() + light.edge_v.has_value();
    const int middle = light.center.has_value() + light.width.has_value() + light.height.has_value() +
                       light.direction.has_value();
    if (!(edges == 3 && middle == 0) && !(edges == 0 && middle == 4)) {
      refuse(table, "",
             "a quad light needs corner, edge_u, edge_v (m), or else center, width, height (m), direction");
    }
    if (edges && !(light.edge_u->cross(*light.edge_v).norm() > 0)) {
      refuse(table, "edge_v", "edge_u and edge_v of the quad light are parallel");
    }
    if (middle) require_direction(*light.direction, table, "direction");
  }

  void light(const std::string& table, const LightConfig& light) const {
    if (light.type == "quad") quad(table, light);
    if (light.type == "sphere" && !light.center)
      refuse(table, "", "a sphere light needs 'center', 3 numbers (m)");
    file(table, "file", light.file);
    if (light.type == "sun" || light.type == "day_sky") sun(table, light);
  }

  // A day sky without a sun of its own has that of the scene.
  void sun(const std::string& table, const LightConfig& light) const {
    const int angles = light.azimuth.has_value() + light.elevation.has_value();
    const bool shared = light.type == "day_sky" && !light.direction && angles == 0;
    const LightConfig* from = shared ? first_sun(scene) : &light;
    if (!from)
      refuse(table, "", "a day_sky needs direction, azimuth and elevation (degrees), or a sun beside it");
    if (shared ? false : light.direction ? angles != 0 : angles != 2) {
      refuse(table, "", "a " + light.type + " needs direction, or else azimuth and elevation (degrees)");
    }
    if (light.direction) require_direction(*light.direction, table, "direction");
    const double up = from->direction ? from->direction->y() : from->elevation.value_or(0);
    if (light.type == "day_sky" && up < 0) refuse(table, "", "the sun of this day_sky is below the horizon");
  }

  template <class List, class Check>
  void each(const std::string& table, const List& list, Check&& check) const {
    for (std::size_t i = 0; i < list.size(); ++i) check(table_of(table, i), list[i]);
  }

  void all() const {
    word("", scene.name);
    camera();
    output();
    preview();
    simulation();
    if (scene.snow.empty()) refuse("", "", "empty snow: the scene has no [[snow]]");
    names("snow", scene.snow);
    names("collider", scene.colliders);
    names("surface", scene.surfaces);
    each("snow", scene.snow, [&](const std::string& table, const SnowConfig& snow) {
      shape(table, snow.shape);
      moduli(table, snow);
      limits(table, snow.material);
    });
    each("collider", scene.colliders, [&](const std::string& table, const ColliderConfig& collider) {
      shape(table, collider.shape);
      friction(table, collider);
      motion(table, collider);
      surface_name(table, collider.surface);
    });
    each("object", scene.objects, [&](const std::string& table, const ObjectConfig& object) {
      shape(table, object.shape);
      surface_name(table, object.surface);
    });
    if (scene.ground) {
      surface_name("ground", scene.ground->surface);
      friction("ground", *scene.ground);
    }
    each("surface", scene.surfaces, [&](const std::string& table, const SurfaceConfig& surface) {
      file(table, "texture", surface.file);
    });
    each("light", scene.lights, [&](const std::string& table, const LightConfig& l) { light(table, l); });
  }
};

}  // namespace

const LightConfig* first_sun(const SceneConfig& scene) {
  const auto found = std::find_if(scene.lights.begin(), scene.lights.end(),
                                  [](const LightConfig& light) { return light.type == "sun"; });
  return found == scene.lights.end() ? nullptr : &*found;
}

std::string table_of(const std::string& list, std::size_t index) {
  return list + "[" + std::to_string(index) + "]";
}

std::string place_of(const SceneConfig& scene, const std::string& table, const std::string& key) {
  const std::string path = table.empty() ? key : key.empty() ? table : table + "." + key;
  for (const std::string& name : {path, table}) {
    const auto place = scene.places.find(name);
    if (place != scene.places.end()) return place->second;
  }
  return scene.file + ":1:1";
}

void validate(const SceneConfig& scene) { Checker{scene}.all(); }

}  // namespace firn
