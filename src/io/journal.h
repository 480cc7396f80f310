// SPDX-License-Identifier: MIT
// frames.jsonl: one line of JSON for each finished frame, added when its files are on the disk. So a frame
// costs the same work however many there are before it. A line ends in the hash of the run's key and of the
// text before it: what was cut off, damaged or written by another run does not count, as if that frame had
// not been made. Of two lines of one frame the later one counts.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "src/io/manifest.h"

namespace firn {

// To a journal that replace_journal() has begun, by several processes, if need be. Errors: io Error if there
// is none, or if the disk is full; then the last line may be there in part.
void append_journal(const std::filesystem::path& path, const std::string& key, const FrameRecord& record);
// The file with these frames alone, in place of what is there.
void replace_journal(const std::filesystem::path& path, const std::string& key,
                     const std::vector<FrameRecord>& frames);
// Whole lines, in the order of their frames; none if there is no such file. Errors: io Error for a file that
// cannot be read.
std::vector<FrameRecord> read_journal(const std::filesystem::path& path, const std::string& key);

// What was added since the last look, by whomever.
class JournalTail {
 public:
  JournalTail(std::filesystem::path path, std::string key) : path_(std::move(path)), key_(std::move(key)) {}
  // Whole lines in the order in which they were added. Errors: as of read_journal().
  std::vector<FrameRecord> read();

 private:
  std::filesystem::path path_;
  std::string key_;
  std::size_t read_ = 0;  // bytes
};

}  // namespace firn
