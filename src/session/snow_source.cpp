// SPDX-License-Identifier: MIT
#include "src/session/snow_source.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/particle_file.h"

namespace firn {

std::string snapshot_hash(const Snapshot& snapshot) {
  const std::string bytes = encode_snapshot(snapshot);
  return hash_in_hex(bytes);
}

SimulatedSnow::SimulatedSnow(Solver simulation, double seconds_per_frame)
    : simulation_(std::move(simulation)), seconds_per_frame_(seconds_per_frame) {}

bool SimulatedSnow::fetch(int frame, Snapshot& out, FrameRecord& record, const std::stop_token& stop) {
  if (const auto kept = pending_.find(frame); kept != pending_.end()) {
    out = std::move(kept->second.snow);
    record = std::move(kept->second.record);
    pending_.erase(kept);
    return true;
  }
  // Every frame on the way is reached exactly, shown or not: the same steps whichever frames are asked for.
  while (reached_ < frame) {
    if (!simulation_.advance_to((reached_ + 1) * seconds_per_frame_, stop)) return false;
    ++reached_;
    if (reached_ < frame) steps_before_ = simulation_.particle_steps();
  }
  simulation_.snapshot(out);
  out.frame = frame;
  record.metrics = simulation_.metrics();
  record.particle_steps = record.metrics.particle_steps - steps_before_;
  steps_before_ = record.metrics.particle_steps;
  return true;
}

void SimulatedSnow::drive(std::size_t collider, ColliderDriver driver) {
  simulation_.drive(collider, std::move(driver));
}

double SimulatedSnow::bytes_per_particle() const {
  return static_cast<double>(simulation_.resident_bytes()) /
         static_cast<double>(std::max<std::size_t>(simulation_.particle_count(), 1));
}

void SimulatedSnow::restore(Checkpoint checkpoint, const std::vector<int>& wanted) {
  std::istringstream in(std::move(checkpoint.state));
  simulation_.load(in);
  reached_ = checkpoint.frame;
  steps_before_ = checkpoint.particle_steps;
  for (auto& frame : checkpoint.pending) {
    if (std::binary_search(wanted.begin(), wanted.end(), frame.snow.frame))
      pending_[frame.snow.frame] = std::move(frame);
  }
}

Checkpoint SimulatedSnow::checkpoint() const {
  std::string room;  // a stream that grows by itself would copy the state, and hold twice as much
  room.reserve(kSavedBytes * simulation_.particle_count());
  std::ostringstream out(std::move(room));
  simulation_.save(out);
  Checkpoint checkpoint;
  checkpoint.frame = reached_;
  checkpoint.particle_steps = steps_before_;
  for (const auto& [number, frame] : pending_) checkpoint.pending.push_back(frame);
  checkpoint.state = std::move(out).str();
  return checkpoint;
}

RecordedSnow::RecordedSnow(const std::filesystem::path& run) : folder_(RunFolder::open(run)) {
  const Manifest manifest = read_manifest(folder_.manifest(), folder_.journal());
  origin_ = manifest.origin();
  for (const auto& record : manifest.frames) records_[record.frame] = record;
}

void RecordedSnow::keep_only(const std::vector<int>& frames) {
  std::erase_if(records_,
                [&](const auto& r) { return !std::binary_search(frames.begin(), frames.end(), r.first); });
}

void RecordedSnow::require(const std::string& origin, const std::vector<FrameRecord>& frames) const {
  if (!origin.empty() && origin != origin_) {
    throw Error(ErrorCode::io, folder_.path().string(),
                "this run has other snow than it had when it was rendered");
  }
  for (const FrameRecord& frame : frames) {
    const auto now = records_.find(frame.frame);
    if (now != records_.end() && now->second.particles_hash == frame.particles_hash) continue;
    throw Error(
        ErrorCode::io, folder_.path().string(),
        "this run has other snow than it had when frame " + std::to_string(frame.frame) + " was rendered");
  }
}

bool RecordedSnow::fetch(int frame, Snapshot& out, FrameRecord& record, const std::stop_token&) {
  if (!records_.count(frame)) {
    throw Error(ErrorCode::usage, folder_.path().string(), "this run has no frame " + std::to_string(frame));
  }
  record = records_.at(frame);
  out = read_particle_file(folder_.particle_file(frame));
  if (out.frame != frame || snapshot_hash(out) != record.particles_hash) {
    throw Error(ErrorCode::io, folder_.particle_file(frame).string(),
                "these are not the particles that the run wrote; 'firn resume' of that run makes them again");
  }
  return true;
}

}  // namespace firn
