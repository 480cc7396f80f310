// SPDX-License-Identifier: MIT
#include "src/app/verify.h"

#include <algorithm>

#include "src/core/error.h"
#include "src/io/file.h"

namespace firn {
namespace {

constexpr std::string_view kPictures = "frames/";

std::string untold(const RunFolder& folder, int frame) {
  return folder.journal().string() + " has no whole line of frame " + std::to_string(frame);
}

}  // namespace

std::string fault_of(const std::filesystem::path& file, const std::string& hash) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return file.string() + " is missing";
  try {
    return hash_in_hex(read_file(file)) == hash ? "" : file.string() + " is not what the run wrote";
  } catch (const Error& error) {
    return error.what();
  }
}

Unfinished first_unfinished(const RunFolder& folder, const Manifest& manifest) {
  int frame = manifest.first;
  for (const FrameRecord& record : manifest.frames) {
    if (record.frame != frame) return {frame, untold(folder, frame)};
    for (const auto& [file, hash] : record.files) {
      if (!manifest.pictures && file.starts_with(kPictures)) continue;
      if (std::string why = fault_of(folder.path() / file, hash); !why.empty())
        return {frame, std::move(why)};
    }
    ++frame;
  }
  const bool lost = manifest.status == "complete" && frame <= manifest.last;
  return {frame, lost ? untold(folder, frame) : ""};
}

bool has_pictures(const RunFolder& folder, const Manifest& manifest, int frame) {
  const auto record = std::find_if(manifest.frames.begin(), manifest.frames.end(),
                                   [frame](const FrameRecord& r) { return r.frame == frame; });
  if (record == manifest.frames.end()) return false;
  int pictures = 0;
  for (const auto& [file, hash] : record->files) {
    if (!file.starts_with(kPictures)) continue;
    if (!fault_of(folder.path() / file, hash).empty()) return false;
    ++pictures;
  }
  return pictures > 0;
}

void require_inputs(const Manifest& manifest, const SceneConfig& scene) {
  const std::vector<std::string> used = input_files(scene);
  for (const auto& [file, hash] : manifest.inputs) {
    if (std::find(used.begin(), used.end(), file) == used.end() || hash_in_hex(read_file(file)) == hash)
      continue;
    throw Error(ExitCode::io, file,
                "has changed since the run began: put the old file back, or start a new run");
  }
}

void require_scene(const RunFolder& folder, const Manifest& manifest) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder.scene(), ignored) || read_file(folder.scene()) == manifest.scene)
    return;
  throw Error(ExitCode::usage, folder.scene().string(),
              "has been changed, but a run goes on with the scene that it began with: delete the file, or "
              "move it and "
              "'firn run' it");
}

}  // namespace firn
