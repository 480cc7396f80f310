// SPDX-License-Identifier: MIT
// In: a folder. Out: small files of firn's own formats in it, for the fuzzers to start from, in a folder a
// reader: particles/, points/, checkpoint/, state/, manifest/, journal/, images/; and params.txt, all keys of
// a scene.
#include <cstdio>
#include <sstream>
#include <string>

#include "firn/error.h"
#include "src/io/checkpoint.h"
#include "src/io/file.h"
#include "src/io/images.h"
#include "src/io/journal.h"
#include "src/io/manifest.h"
#include "src/io/particle_file.h"
#include "tests/fuzz/tiny_snow.h"

namespace firn::fuzz {
namespace {

std::filesystem::path place(const std::filesystem::path& folder, const char* reader, const char* name) {
  std::filesystem::create_directories(folder / reader);
  return folder / reader / name;
}

void write_images(const std::filesystem::path& folder) {
  Image8 image{5, 3, std::vector<std::uint8_t>(45)};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<std::uint8_t>(5 * i);
  write_file(place(folder, "images", "a.png"), encode_png(image));
  write_file(place(folder, "images", "a.ppm"), encode_ppm(image));
  write_file(place(folder, "images", "colour.pfm"), encode_pfm(2, 2, 3, std::vector<float>(12, 0.5f)));
  write_file(place(folder, "images", "grey.pfm"), encode_pfm(3, 2, 1, std::vector<float>(6, 2.f)));
}

void write_snow(const std::filesystem::path& folder) {
  const Solver snow = tiny_snow();
  Snapshot snapshot;
  snow.snapshot(snapshot);
  snapshot.resize(3);
  write_file(place(folder, "particles", "three"), encode_snapshot(snapshot));
  write_file(place(folder, "points", "three"), encode_snapshot(snapshot));
  write_file(place(folder, "particles", "none"), encode_snapshot(Snapshot{}));
  snapshot.driven.resize(2);
  snapshot.driven[0].name = "blade";
  write_file(place(folder, "particles", "driven"), encode_snapshot(snapshot));
  snapshot.driven.clear();
  std::ostringstream state;
  snow.save(state);
  write_file(place(folder, "state", "tiny"), state.str());
  snapshot.frame = 1;
  Checkpoint two{42, 7, 9, {{}, {{}, snapshot}}, "state"};
  two.pending[1].record.frame = 1;
  write_checkpoint(place(folder, "checkpoint", "two"), two);
  write_checkpoint(place(folder, "checkpoint", "none"), {42, 7, 9, {}, state.str()});
  Manifest manifest;
  manifest.scene_hash = hash_in_hex("");
  write_manifest(place(folder, "manifest", "empty.json"), manifest);
  FrameRecord frame;
  frame.metrics = snow.metrics();
  frame.files = {{"frames/0000.png", "0123456789abcdef"}};
  replace_journal(place(folder, "journal", "one.jsonl"), "key", {frame});
  manifest.frames = {frame};
  std::ostringstream printed;
  print_manifest(printed, manifest);
  write_file(place(folder, "manifest", "with_frames.json"), printed.str());
}

void write_params(const std::filesystem::path& folder) {
  std::ostringstream params;
  print_params(params, "");
  write_file(folder / "params.txt", params.str());
}

}  // namespace
}  // namespace firn::fuzz

int main(int count, char** words) {
  if (count != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  try {
    firn::fuzz::write_images(words[1]);
    firn::fuzz::write_snow(words[1]);
    firn::fuzz::write_params(words[1]);
  } catch (const firn::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
