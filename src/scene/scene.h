// SPDX-License-Identifier: MIT
// From a scene file to what the simulation and the renderer need.
#pragma once
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firn/scene.h"
#include "src/scene/config.h"

namespace firn {

// Complete and free of contradictions. Errors: those of Scene::check().
SceneConfig config_of(const Scene& scene);

// The scene of a saved state: with the arrays that its text names by number.
Scene scene_with(Scene scene, std::vector<std::shared_ptr<const PointCloud>> arrays);

// Scene::read() and Scene::parse(), as what they are for the rooms below.
SceneConfig read_scene(const std::string& file, const ReadOptions& options);
SceneConfig read_scene_text(const std::string& text, const std::string& file, const ReadOptions& options);

// The files that the scene names, absolute, each once, in order.
std::vector<std::string> input_files(const SceneConfig& scene);

// Of what snow collides with, as SolverSetup::colliders has it.
std::vector<std::string> collider_names(const SceneConfig& scene);

// The scene with every default written out, as TOML that read_scene reads back to the same config.
std::string resolved_toml(const SceneConfig& scene);

// Places the particles (deterministic in the seed) and converts units. Errors: usage Error for empty snow,
// missing files, a fixed dt above the stable bound unless `force`.
SolverSetup build_simulation(const SceneConfig& scene, bool force = false);
RenderSetup build_render(const SceneConfig& scene);
std::optional<Shape> domain_of(const SceneConfig& scene);
double grid_spacing(const SceneConfig& scene);  // m: dx, or from particles_across

// `firn params [WORD]`: every key with type, unit, default, range and meaning, or only those whose name
// begins with the word; where none does, those with the word in name or meaning. Errors: usage Error if there
// is none either.
void print_params(std::ostream& out, const std::string& word);
// docs/scene_format.md, generated from the same table.
std::string scene_format_markdown();

}  // namespace firn
