// SPDX-License-Identifier: MIT
#include "src/session/verify.h"

#include <algorithm>

#include "firn/error.h"
#include "src/io/file.h"

namespace firn {
namespace {

constexpr std::string_view kPictures = "frames/", kParticles = "particles/";  // in the run folder

std::string untold(const RunFolder& folder, int frame) {
  return folder.journal().string() + " has no whole line of frame " + std::to_string(frame);
}

// Of the first file at fault in this part of the run folder.
std::string fault_among(const RunFolder& folder, const FrameRecord& record, std::string_view part) {
  for (const auto& [file, hash] : record.files) {
    if (!file.starts_with(part)) continue;
    if (std::string fault = fault_of(folder.path() / file, hash); !fault.empty()) return fault;
  }
  return "";
}

}  // namespace

std::string fault_of(const std::filesystem::path& file, const std::string& hash) {
  std::error_code error;
  const bool exists = std::filesystem::exists(file, error);
  if (error) throw Error(ErrorCode::io, file.string(), "cannot be looked at: " + error.message());
  if (!exists) return file.string() + " is missing";
  try {
    return hash_in_hex(read_file(file)) == hash ? "" : file.string() + " is not what the run wrote";
  } catch (const Error& error) {
    return error.what();
  }
}

Unfinished find_unfinished(const RunFolder& folder, const Manifest& manifest) {
  Unfinished found;
  const auto add = [&](int frame, std::string fault) {
    found.frames.push_back(frame);
    if (!fault.empty()) found.damaged.push_back(frame);
    if (found.why.empty()) found.why = std::move(fault);
  };
  auto record = manifest.frames.begin();
  for (int frame = manifest.first; frame <= manifest.last; ++frame) {
    if (record == manifest.frames.end() || record->frame != frame) {
      const bool lost = record != manifest.frames.end() || manifest.status == "complete";
      add(frame, lost ? untold(folder, frame) : "");
      continue;
    }
    const std::string snow = fault_among(folder, *record, kParticles);
    const std::string pictures = manifest.pictures ? fault_among(folder, *record, kPictures) : "";
    if (!snow.empty() || !pictures.empty()) add(frame, snow.empty() ? pictures : snow);
    if (snow.empty() && !pictures.empty() && manifest.particles) found.kept.push_back(frame);
    ++record;
  }
  return found;
}

bool has_pictures(const RunFolder& folder, const FrameRecord& record) {
  const auto is_picture = [](const auto& file) { return file.first.starts_with(kPictures); };
  return std::any_of(record.files.begin(), record.files.end(), is_picture) &&
         fault_among(folder, record, kPictures).empty();
}

void require_inputs_exist(const Manifest& manifest) {
  std::error_code ignored;
  for (const auto& [file, hash] : manifest.inputs) {
    if (std::filesystem::exists(file, ignored)) continue;
    try {
      read_scene(manifest.scene_file, {});
    } catch (const Error& error) {
      if (std::string_view(error.what()).find(file) != std::string_view::npos) throw;
    }
    throw Error(ErrorCode::io, file, "no such file, but the scene of this run needs it");
  }
}

void require_inputs(const Manifest& manifest, const SceneConfig& scene) {
  const std::vector<std::string> used = input_files(scene);
  for (const auto& [file, hash] : manifest.inputs) {
    if (std::find(used.begin(), used.end(), file) == used.end() || hash_in_hex(read_file(file)) == hash)
      continue;
    throw Error(ErrorCode::io, file,
                "has changed since the run began: put the old file back, or start a new run");
  }
}

void require_scene(const RunFolder& folder, const Manifest& manifest) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder.scene(), ignored) || read_file(folder.scene()) == manifest.scene)
    return;
  throw Error(ErrorCode::usage, folder.scene().string(),
              "has been changed, but a run goes on with the scene that it began with: delete the file, or "
              "move it and "
              "'firn run' it");
}

}  // namespace firn
