// SPDX-License-Identifier: MIT
// frames.jsonl: one line of JSON for each finished frame, added when its files are on the disk. So a frame
// costs the same work however many there are before it. A line ends in the hash of the run's key and of the
// text before it: what was cut off, damaged or written by another run does not count, as if that frame had
// not been made. Of two lines of one frame the later one counts.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "src/io/manifest.h"

namespace firn {

// Errors: io Error if the disk is full; then the last line may be there in part.
void append_journal(const std::filesystem::path& path, const std::string& key, const FrameRecord& record);
// The file with these frames alone, in place of what is there.
void replace_journal(const std::filesystem::path& path, const std::string& key,
                     const std::vector<FrameRecord>& frames);
// Whole lines, in the order of their frames; none if there is no such file. Errors: io Error for a file that
// cannot be read.
std::vector<FrameRecord> read_journal(const std::filesystem::path& path, const std::string& key);

}  // namespace firn
