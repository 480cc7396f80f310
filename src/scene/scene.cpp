// SPDX-License-Identifier: MIT
// In: a scene file, its [quick] table, --set. Out: a SceneConfig that is complete and free of contradictions.
#include "src/scene/scene.h"

#include <algorithm>
#include <filesystem>

#include "src/core/error.h"
#include "src/io/file.h"
#include "src/scene/name.h"
#include "src/scene/override.h"
#include "src/scene/parse.h"
#include "src/scene/toml_text.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;  // of a scene file
constexpr int kDefaultAcross = 40;  // particles across the smallest snow object, when nothing is said

template <class List>
void name_by_number(List& list, const std::string& word) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].name.empty()) list[i].name = word + std::to_string(i);
  }
}

// Every place in a scene that may name a file.
template <class Scene, class Visit>
void for_each_file(Scene& scene, const Visit& visit) {
  for (auto& snow : scene.snow) visit(snow.shape.file);
  for (auto& collider : scene.colliders) visit(collider.shape.file);
  for (auto& object : scene.objects) visit(object.shape.file);
  for (auto& light : scene.lights) visit(light.file);
  for (auto& surface : scene.surfaces) visit(surface.file);
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
  for_each_file(scene, [&](std::optional<std::string>& file) {
    if (file && !file->empty()) file = std::filesystem::absolute(folder / *file).lexically_normal().string();
  });
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
      throw Error(ErrorCode::usage, file, "the scene has no [quick] table, and so no quick size");
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

std::vector<std::string> input_files(const SceneConfig& scene) {
  std::vector<std::string> files;
  for_each_file(scene, [&](const std::optional<std::string>& file) {
    if (file && std::find(files.begin(), files.end(), *file) == files.end()) files.push_back(*file);
  });
  return files;
}

SceneConfig read_scene(const std::string& file, const ReadOptions& options) {
  if (file == "-") return read_scene_text(read_standard_input(kMostBytes), "stdin", options);
  std::error_code unknown;  // and then reading says why
  if (std::filesystem::is_directory(file, unknown)) {
    const bool is_run = std::filesystem::exists(file + "/run.json", unknown);
    throw Error(ErrorCode::io, file,
                is_run ? "this is the folder of a run, not a scene file; its scene is " + file +
                             "/scene.resolved.toml"
                       : "this is a folder, not a scene file");
  }
  if (std::filesystem::file_size(file, unknown) > kMostBytes && !unknown) {
    throw Error(ErrorCode::io, file,
                "larger than " + std::to_string(kMostBytes >> 20) + " MiB: this is no scene file");
  }
  return read_scene_text(read_file(file), file, options);
}

}  // namespace firn
