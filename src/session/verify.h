// SPDX-License-Identifier: MIT
// What is on the disk against the hashes that a run's manifest has of it. Whole files are read.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "src/io/manifest.h"
#include "src/io/run_folder.h"
#include "src/scene/scene.h"

namespace firn {

// "" if the file's bytes have this hash, else one line: it is missing, or it is not what the run wrote.
// Errors: io Error if that cannot be found out, for want of permission to its folder, say.
std::string fault_of(const std::filesystem::path& file, const std::string& hash);

struct Unfinished {
  std::vector<int> frames;   // without a record, or with a file at fault; ascending
  std::vector<int> damaged;  // of these, those that were finished once
  std::vector<int> kept;     // of these, those whose particle file is whole
  std::string why;           // the first fault; empty if none is damaged
};
// Of a run without pictures those that `firn render` added are not looked at.
Unfinished find_unfinished(const RunFolder& folder, const Manifest& manifest);

// Whether the record says that there are pictures of its frame, and all are as it says.
bool has_pictures(const RunFolder& folder, const FrameRecord& record);

// Errors: io Error for a file of the scene that is gone, at its place in the scene that the run was made
// from, if that still names it: the lines of the run's own copy are others.
void require_inputs_exist(const Manifest& manifest);

// Errors: io Error for a file of the scene that is not what it was when the run began.
void require_inputs(const Manifest& manifest, const SceneConfig& scene);

// Errors: usage Error if somebody changed the run's own copy of its scene.
void require_scene(const RunFolder& folder, const Manifest& manifest);

}  // namespace firn
