// SPDX-License-Identifier: MIT
// In: a scene file, its [quick] table, --set. Out: a SceneConfig that is complete and free of contradictions.
#include "src/scene/scene.h"

#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "src/core/error.h"
#include "src/scene/override.h"
#include "src/scene/parse.h"
#include "src/scene/toml_text.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

constexpr int kDefaultAcross = 40;  // particles across the smallest snow object, when nothing is said

template <class List>
void name_by_number(List& list, const std::string& word) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].name.empty()) list[i].name = word + std::to_string(i);
  }
}

// "my scene.resolved.toml" -> "my_scene".
std::string name_from_file(const std::string& file) {
  std::string name = std::filesystem::path(file).filename().string();
  name = name.substr(0, name.find('.'));
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '_';
  }
  return name.empty() ? "scene" : name;
}

void resolve_file(std::optional<std::string>& file, const std::filesystem::path& folder) {
  if (file) file = std::filesystem::absolute(folder / *file).lexically_normal().string();
}

// Late afternoon: a warm sun low on the left behind the camera and a blue sky.
std::vector<LightConfig> default_lights() {
  LightConfig sun, sky;
  sun.type = "sun";
  sun.azimuth = -50;
  sun.elevation = 24;
  sky.type = "sky";
  return {sun, sky};
}

void complete(SceneConfig& scene) {
  SimulationConfig& simulation = scene.simulation;
  if (!simulation.dx && !simulation.particles_across) simulation.particles_across = kDefaultAcross;
  if (scene.lights.empty()) scene.lights = default_lights();
  if (scene.name.empty() && !scene.places.count("name")) scene.name = name_from_file(scene.file);
  name_by_number(scene.snow, "snow");
  name_by_number(scene.colliders, "collider");
  const std::filesystem::path folder = std::filesystem::path(scene.file).parent_path();
  for (SnowConfig& snow : scene.snow) resolve_file(snow.shape.file, folder);
  for (ColliderConfig& collider : scene.colliders) resolve_file(collider.shape.file, folder);
  for (ObjectConfig& object : scene.objects) resolve_file(object.shape.file, folder);
  for (LightConfig& light : scene.lights) resolve_file(light.file, folder);
  for (SurfaceConfig& surface : scene.surfaces) resolve_file(surface.file, folder);
}

void derive_moduli(SnowConfig& snow) {
  if (!snow.mu) return;
  const double mu = *snow.mu, lambda = *snow.lambda;
  snow.material.young_modulus = mu * (3 * lambda + 2 * mu) / (lambda + mu);
  snow.material.poisson_ratio = lambda / (2 * (lambda + mu));
  snow.mu = snow.lambda = std::nullopt;
}

void apply_overrides(RawTable& root, const std::string& file, const ReadOptions& options) {
  if (options.quick) {
    if (!root.find("quick"))
      throw Error(ExitCode::usage, file, "the scene has no [quick] table, and so no quick size");
    apply_quick(root);
  }
  for (const SceneOverride& change : options.overrides) apply_override(root, change);
}

// The small size is checked even when the full one is asked for, so that a typing error in it does not wait.
void check_quick(RawTable root, const std::string& file) {
  apply_quick(root);
  parse_scene(root, file);
}

}  // namespace

SceneConfig read_scene_text(const std::string& text, const std::string& file, const ReadOptions& options) {
  RawTable root = parse_toml(text, file);
  if (!options.quick && root.find("quick")) check_quick(root, file);
  apply_overrides(root, file, options);
  SceneConfig scene = parse_scene(root, file);
  complete(scene);
  validate(scene);
  for (SnowConfig& snow : scene.snow) derive_moduli(snow);
  return scene;
}

SceneConfig read_scene(const std::string& file, const ReadOptions& options) {
  std::ifstream in(file, std::ios::binary);
  if (!in || std::filesystem::is_directory(file))
    throw Error(ExitCode::io, file, "cannot read this scene file");
  std::ostringstream text;
  text << in.rdbuf();
  return read_scene_text(text.str(), file, options);
}

}  // namespace firn
