// SPDX-License-Identifier: MIT
// From a scene file to what the simulation and the renderer need.
#pragma once
#include <iosfwd>
#include <string>
#include <vector>

#include "src/scene/config.h"

namespace firn {

// One `--set path=value`: "snow.young_modulus=2e5" (every [[snow]]), "snow[0].radius=0.1",
// "snow.left.radius=0.1" (by name), "image.width=320". The value is TOML; a bare word is taken as a string.
struct SceneOverride {
  std::string path;
  std::string value;
};

struct ReadOptions {
  bool quick = false;  // apply the scene's [quick] table (same paths as --set, written as TOML)
  std::vector<SceneOverride> overrides;  // after [quick]
};

// Errors: usage Error "scene.toml:12:3: ..." for syntax, unknown key (with "did you mean"), wrong type, out
// of range, contradiction; io Error when the file cannot be read. The file "-" is the standard input, which
// errors call "stdin".
SceneConfig read_scene(const std::string& file, const ReadOptions& options);
SceneConfig read_scene_text(const std::string& text, const std::string& file, const ReadOptions& options);

// The files that the scene names, absolute, each once, in order.
std::vector<std::string> input_files(const SceneConfig& scene);

// The scene with every default written out, as TOML that read_scene reads back to the same config.
std::string resolved_toml(const SceneConfig& scene);

// Places the particles (deterministic in the seed) and converts units. Errors: usage Error for empty snow,
// missing files, a fixed dt above the stable bound unless `force`.
SimulationSetup build_simulation(const SceneConfig& scene, bool force = false);
RenderSetup build_render(const SceneConfig& scene);
double grid_spacing(const SceneConfig& scene);  // m: dx, or from particles_across

// `firn params [WORD]`: every key with type, unit, default, range and meaning, or only those whose name
// begins with the word; where none does, those with the word in name or meaning. Errors: usage Error if there
// is none either.
void print_params(std::ostream& out, const std::string& word);
// docs/scene_format.md, generated from the same table.
std::string scene_format_markdown();

}  // namespace firn
