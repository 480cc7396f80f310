// SPDX-License-Identifier: MIT
// The frames of a recorded run that get their pictures from any number of processes at a time, on one machine
// or on several: each claims a frame before it renders it, and learns from the journal which ones the others
// have finished.
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "src/io/file_lock.h"
#include "src/io/journal.h"
#include "src/io/run_folder.h"

namespace firn {

class SharedFrames {
 public:
  // `again`: pictures that are there already do not count. The folder must outlive this.
  SharedFrames(const RunFolder& folder, const Manifest& run, std::vector<int> frames, bool again);

  // Those without whole pictures, ascending.
  std::vector<int> left();
  // False if another process has the frame or has finished it. Errors: io Error if the claim cannot be
  // written.
  bool claim(int frame);
  void release(int frame);  // once the journal has it

 private:
  void learn();  // what the journal has got since
  bool has_pictures(int frame);

  const RunFolder& folder_;
  const std::vector<int> frames_;
  std::mutex mutex_;
  JournalTail journal_;
  std::map<int, FrameRecord> records_;  // of frames that are not known to be finished
  std::set<int> finished_;
  std::map<int, std::unique_ptr<FileLock>> claims_;
};

}  // namespace firn
