// SPDX-License-Identifier: MIT
// Everything that an interrupted run needs to go on as if it had not been: the simulation's own stream, and
// the frames that it had passed but that were not yet written, with their records. One file that needs no
// other, so that whichever checkpoint is left can be gone on from.
//
//   "FIRNCKPT"  u32 version  u64 hash of the resolved scene  i32 frame  u64 particle-steps
//   u32 pending frames  { u64 bytes, record as JSON, u64 bytes, particle file } x pending
//   u64 bytes, Solver::save stream    u64 XXH3 of all before
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "firn/snapshot.h"
#include "src/io/manifest.h"

namespace firn {

struct PendingFrame {
  FrameRecord record;  // as far as the simulation filled it
  Snapshot snow;
};

struct Checkpoint {
  std::uint64_t scene_hash = 0;
  int frame = -1;                     // the last frame whose time the simulation has reached
  std::uint64_t particle_steps = 0;   // up to that frame
  std::vector<PendingFrame> pending;  // frames up to `frame` that were not written, in order, each once
  std::string state;                  // what Solver::save wrote
};

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);
// Errors: io Error for a missing or damaged file, one of another scene than `scene_hash`, or pending frames
// that do not ascend.
Checkpoint read_checkpoint(const std::filesystem::path& path, std::uint64_t scene_hash);

}  // namespace firn
