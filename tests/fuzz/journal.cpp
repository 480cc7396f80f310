// SPDX-License-Identifier: MIT
// No random line passes its hash, so each input is read as it is and once more with the hashes of its lines
// put right: a line without a hash gets one. The laws: frames ascend, and what was read is written as it is
// read.
#include "src/io/journal.h"

#include <string>
#include <vector>

#include "firn/error.h"
#include "src/io/file.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

const std::string kKey = "key";

std::string signed_line(std::string_view line) {
  const std::string_view text = line.substr(0, line.rfind(",\"hash\""));
  return std::string(text) + ",\"hash\":\"" + hash_in_hex(kKey + std::string(text)) + "\"}\n";
}

std::string signed_lines(std::string_view input) {
  std::string lines;
  for (std::size_t begin = 0, end; (end = input.find('\n', begin)) != std::string_view::npos; begin = end + 1)
    lines += signed_line(input.substr(begin, end - begin));
  return lines;
}

void read(std::string_view bytes) {
  const std::vector<FrameRecord> frames = read_journal(MemoryFile(bytes).path(), kKey);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    require(k == 0 || frames[k - 1].frame < frames[k].frame, "the frames of a journal ascend");
    const std::string line = encode_record(frames[k]);
    require(encode_record(decode_record(line, "line")) == line,
            "a record that was read is written as it is read");
  }
}

}  // namespace

void journal(std::string_view input) {
  try {
    read(input);
    read(signed_lines(input));
  } catch (const Error&) {
  }
}

}  // namespace firn::fuzz
