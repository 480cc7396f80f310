// SPDX-License-Identifier: MIT
// In: a scene file, its [quick] table, --set. Out: a SceneConfig that is complete and free of contradictions.
#include "src/scene/scene.h"

#include <algorithm>
#include <filesystem>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/point_arrays.h"
#include "src/scene/name.h"
#include "src/scene/override.h"
#include "src/scene/parse.h"
#include "src/scene/toml_text.h"
#include "src/scene/validate.h"
#include "src/scene/value.h"

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
    if (file && !file->empty() && !names_arrays(*file))
      file = std::filesystem::absolute(folder / *file).lexically_normal().string();
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

RawTable read_tree(const std::string& text, const std::string& file, const ReadOptions& options) {
  RawTable root = parse_toml(text, file);
  if (!options.quick && root.find("quick")) check_quick(root, file);
  apply_overrides(root, file, options);
  return root;
}

SceneConfig config_of_tree(const RawTable& root, const std::string& file) {
  SceneConfig scene = parse_scene(root, file);
  complete(scene);
  validate(scene);
  for (SnowConfig& snow : scene.snow) derive_moduli(snow);
  return scene;
}

std::string text_of(const std::string& file) {
  if (file == "-") return read_standard_input(kMostBytes);
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
  return read_file(file);
}

// What errors call it.
std::string name_of(const std::string& file) { return file == "-" ? "stdin" : file; }

}  // namespace

std::vector<std::string> input_files(const SceneConfig& scene) {
  std::vector<std::string> files;
  for_each_file(scene, [&](const std::optional<std::string>& file) {
    if (file && !names_arrays(*file) && std::find(files.begin(), files.end(), *file) == files.end())
      files.push_back(*file);
  });
  return files;
}

std::vector<std::string> collider_names(const SceneConfig& scene) {
  std::vector<std::string> names;
  if (scene.ground) names.push_back("ground");
  for (const ColliderConfig& collider : scene.colliders) names.push_back(collider.name);
  return names;
}

SceneConfig read_scene_text(const std::string& text, const std::string& file, const ReadOptions& options) {
  return config_of_tree(read_tree(text, file, options), file);
}

SceneConfig read_scene(const std::string& file, const ReadOptions& options) {
  return read_scene_text(text_of(file), name_of(file), options);
}

struct Scene::State {
  RawTable root;
  std::string file;
  std::vector<std::shared_ptr<const PointCloud>> arrays = {};
};

Scene::Scene(State state) : state_(std::make_unique<State>(std::move(state))) {}

Scene::Scene(const std::string& name, const Place& place) : Scene(State{{}, "scene"}) {
  set("name", name, place);
}
Scene::Scene(const std::string& name, const char* file, int line)
    : Scene(name, Place{std::string(file) + ":" + std::to_string(line)}) {}
Scene::Scene(const Scene& other) : Scene(State(*other.state_)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene::~Scene() = default;

Scene& Scene::operator=(Scene other) noexcept {
  state_.swap(other.state_);
  return *this;
}

Scene Scene::parse(const std::string& text, const std::string& file, const ReadOptions& options) {
  Scene scene(State{read_tree(text, file, options), file});
  scene.check();
  return scene;
}

Scene Scene::read(const std::string& file, const ReadOptions& options) {
  return parse(text_of(file), name_of(file), options);
}

Scene& Scene::set(const std::string& path, const Value& value, const char* file, int line) {
  return set(path, value, Place{std::string(file) + ":" + std::to_string(line)});
}

Scene& Scene::add(const std::string& list, const Table& keys, const char* file, int line) {
  return add(list, keys, Place{std::string(file) + ":" + std::to_string(line)});
}

Scene& Scene::set(const std::string& path, const Value& value, const Place& place) {
  set_value(state_->root, path, raw(value, place.words));
  return *this;
}

Scene& Scene::add(const std::string& list, const Table& keys, const Place& place) {
  add_table(state_->root, list, raw(keys, place.words));
  return *this;
}

Scene& Scene::add_points(const Points& points, const Table& keys, const char* file, int line) {
  return add_points(points, keys, Place{std::string(file) + ":" + std::to_string(line)});
}

Scene& Scene::add_points(const Points& points, const Table& keys, const Place& place) {
  auto cloud = std::make_shared<const PointCloud>(cloud_of(points, place.words));
  Table all = keys;
  all.push_back({"shape", "particles"});
  all.push_back({"file", name_of_arrays(state_->arrays.size())});
  add("snow", all, place);
  state_->arrays.push_back(std::move(cloud));
  return *this;
}

SceneConfig config_of(const Scene& scene) {
  const Scene::State& state = *scene.state_;
  SceneConfig config = config_of_tree(state.root, state.file);
  for (SnowConfig& snow : config.snow) {
    if (!snow.shape.file) continue;
    const auto number = number_of_arrays(*snow.shape.file);
    if (number && *number < state.arrays.size()) snow.shape.points = state.arrays[*number];
  }
  return config;
}

Scene scene_with(Scene scene, std::vector<std::shared_ptr<const PointCloud>> arrays) {
  scene.state_->arrays = std::move(arrays);
  return scene;
}

void Scene::check() const { config_of(*this); }
std::string Scene::toml() const { return resolved_toml(config_of(*this)); }
int Scene::frames() const { return config_of(*this).time.frames; }

double Scene::frame_time(int frame) const {
  const SceneConfig scene = config_of(*this);
  return frame * scene.time.speed / scene.time.fps;
}

}  // namespace firn
