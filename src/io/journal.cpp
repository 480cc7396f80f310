// SPDX-License-Identifier: MIT
#include "src/io/journal.h"

#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "firn/error.h"
#include "src/io/file.h"

namespace firn {
namespace {

constexpr std::string_view kLineHashKey = ",\"hash\":\"", kLineEnd = "\"}";
constexpr std::size_t kTail = kLineHashKey.size() + 16 + kLineEnd.size();

std::string tail_of(const std::string& key, std::string_view text) {
  return std::string(kLineHashKey).append(hash_in_hex(std::string(key).append(text))).append(kLineEnd);
}

std::string line_of(const std::string& key, const FrameRecord& record) {
  std::string line = encode_record(record);
  line.pop_back();  // the brace
  line += tail_of(key, line);
  return line += '\n';
}

std::optional<FrameRecord> record_of(const std::string& key, std::string_view line,
                                     const std::string& where) {
  if (line.size() <= kTail) return std::nullopt;
  const std::string_view text = line.substr(0, line.size() - kTail);
  if (line.substr(text.size()) != tail_of(key, text)) return std::nullopt;
  return decode_record(line, where);
}

}  // namespace

void append_journal(const std::filesystem::path& path, const std::string& key, const FrameRecord& record) {
  append_line(path, line_of(key, record));
}

void replace_journal(const std::filesystem::path& path, const std::string& key,
                     const std::vector<FrameRecord>& frames) {
  std::string lines;
  for (const FrameRecord& record : frames) lines += line_of(key, record);
  write_file(path, lines);
}

std::vector<FrameRecord> JournalTail::read() {
  std::error_code ignored;
  std::vector<FrameRecord> added;
  if (!std::filesystem::exists(path_, ignored)) return added;
  const std::string bytes = read_file(path_, read_);
  std::string_view rest = bytes;
  for (std::size_t end = rest.find('\n'); end != std::string_view::npos; end = rest.find('\n')) {
    if (auto record = record_of(key_, rest.substr(0, end), path_.string()))
      added.push_back(std::move(*record));
    rest.remove_prefix(end + 1);
    read_ += end + 1;
  }
  return added;
}

std::vector<FrameRecord> read_journal(const std::filesystem::path& path, const std::string& key) {
  std::map<int, FrameRecord> records;
  for (FrameRecord& record : JournalTail(path, key).read()) {
    const int frame = record.frame;
    records[frame] = std::move(record);
  }
  std::vector<FrameRecord> frames;
  frames.reserve(records.size());
  for (auto& [frame, record] : records) frames.push_back(std::move(record));
  return frames;
}

}  // namespace firn
