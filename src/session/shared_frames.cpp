// SPDX-License-Identifier: MIT
#include "src/session/shared_frames.h"

#include <utility>

#include "src/session/verify.h"

namespace firn {

SharedFrames::SharedFrames(const RunFolder& folder, const Manifest& run, std::vector<int> frames, bool again)
    : folder_(folder), frames_(std::move(frames)), journal_(folder.journal(), run.key()) {
  if (again) journal_.read();
}

void SharedFrames::learn() {
  for (FrameRecord& record : journal_.read()) {
    const int frame = record.frame;
    records_[frame] = std::move(record);
  }
}

bool SharedFrames::has_pictures(int frame) {
  if (finished_.count(frame)) return true;
  const auto record = records_.find(frame);
  if (record == records_.end() || !firn::has_pictures(folder_, record->second)) return false;
  finished_.insert(frame);
  records_.erase(record);
  return true;
}

std::vector<int> SharedFrames::left() {
  const std::lock_guard lock(mutex_);
  learn();
  std::vector<int> left;
  for (const int frame : frames_) {
    if (!has_pictures(frame)) left.push_back(frame);
  }
  return left;
}

bool SharedFrames::claim(int frame) {
  const std::lock_guard lock(mutex_);
  if (claims_.count(frame)) return true;
  learn();
  if (has_pictures(frame)) return false;
  std::unique_ptr<FileLock> claim = folder_.claim(frame);
  if (!claim) return false;
  // Another may have finished the frame before the claim was made, and given its own back.
  learn();
  if (has_pictures(frame)) return false;
  claims_[frame] = std::move(claim);
  return true;
}

void SharedFrames::release(int frame) {
  const std::lock_guard lock(mutex_);
  finished_.insert(frame);
  claims_.erase(frame);
}

}  // namespace firn
