// SPDX-License-Identifier: MIT
// Where a frame's snow comes from: simulated now, or read back from a run's particle files. The stages of a
// session do not know which.
#pragma once
#include <filesystem>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include "firn/snapshot.h"
#include "src/io/checkpoint.h"
#include "src/io/manifest.h"
#include "src/io/run_folder.h"
#include "src/mpm/solver.h"
#include "src/particles/fields.h"

namespace firn {

inline constexpr std::size_t kSavedBytes =
    4 * kColumns + 16;  // of a particle in a checkpoint, with its blocks

class SnowSource {
 public:
  virtual ~SnowSource() = default;
  // Fills the snapshot of `frame` and the simulated part of its record. Frames are asked for in order. False
  // if stopped.
  virtual bool fetch(int frame, Snapshot& out, FrameRecord& record, const std::stop_token& stop) = 0;
};

class SimulatedSnow : public SnowSource {
 public:
  // Frame k is the state at k * seconds_per_frame.
  SimulatedSnow(Solver simulation, double seconds_per_frame);
  bool fetch(int frame, Snapshot& out, FrameRecord& record, const std::stop_token& stop) override;
  double bytes_per_particle() const;
  void drive(std::size_t collider, ColliderDriver driver);  // as Solver::drive()

  // Goes on from a checkpoint; of its pending frames it keeps those that are wanted (ascending).
  void restore(Checkpoint checkpoint, const std::vector<int>& wanted);
  // The state as it is now, with the frames of an earlier checkpoint that were not asked for yet; the scene's
  // hash is left to the caller.
  Checkpoint checkpoint() const;
  int reached() const { return reached_; }
  const Solver& simulation() const { return simulation_; }

 private:
  Solver simulation_;
  double seconds_per_frame_;
  int reached_ = 0;                      // last frame whose time the simulation has reached
  std::uint64_t steps_before_ = 0;       // particle-steps up to that frame
  std::map<int, PendingFrame> pending_;  // passed before a checkpoint, not asked for yet
};

class RecordedSnow : public SnowSource {
 public:
  explicit RecordedSnow(const std::filesystem::path& run);
  bool has(int frame) const { return records_.count(frame) > 0; }
  void keep_only(const std::vector<int>& frames);  // ascending
  // Errors: io Error if the snow is of another origin (unless empty), or frames were made of other snow than
  // the run has now.
  void require(const std::string& origin, const std::vector<FrameRecord>& frames) const;
  bool fetch(int frame, Snapshot& out, FrameRecord& record, const std::stop_token& stop) override;

 private:
  RunFolder folder_;
  std::string origin_;
  std::map<int, FrameRecord> records_;
};

std::string snapshot_hash(const Snapshot& snapshot);  // of every column, origin, time and frame

}  // namespace firn
