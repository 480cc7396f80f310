// SPDX-License-Identifier: MIT
#include "src/scene/name.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>

namespace firn {
namespace {

bool in_names(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x80 || std::isalnum(byte) || c == '_' || c == '-';
}

// How many bytes the character that begins with this one has; 0 if none does.
std::size_t utf8_length(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return 3;
  return first >= 0xF0 && first < 0xF5 ? 4 : 0;
}

}  // namespace

bool is_name(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), in_names);
}

std::string name_from_file(const std::string& file) {
  std::string name = std::filesystem::path(file).filename().string();
  name = name.substr(0, name.find('.'));
  // TOML, in which the name is kept, is UTF-8; the names of files need not be.
  const bool ascii_only = !is_utf8(name);
  for (char& c : name) {
    if (!in_names(c) || (ascii_only && static_cast<unsigned char>(c) >= 0x80)) c = '_';
  }
  return name.empty() ? "scene" : name;
}

// Shortest forms only, no surrogates, nothing above U+10FFFF (RFC 3629).
bool is_utf8(std::string_view bytes) {
  while (!bytes.empty()) {
    const auto at = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    const std::size_t length = utf8_length(at(0));
    if (length == 0 || length > bytes.size()) return false;
    for (std::size_t i = 1; i < length; ++i) {
      if ((at(i) & 0xC0) != 0x80) return false;
    }
    if ((at(0) == 0xE0 && at(1) < 0xA0) || (at(0) == 0xED && at(1) >= 0xA0)) return false;
    if ((at(0) == 0xF0 && at(1) < 0x90) || (at(0) == 0xF4 && at(1) >= 0x90)) return false;
    bytes.remove_prefix(length);
  }
  return true;
}

namespace {
constexpr std::string_view kArrays = "arrays:";
}  // namespace

std::string name_of_arrays(std::size_t number) { return std::string(kArrays) + std::to_string(number); }

bool names_arrays(std::string_view file) { return number_of_arrays(file).has_value(); }

std::optional<std::size_t> number_of_arrays(std::string_view file) {
  std::size_t number = 0;
  if (!file.starts_with(kArrays)) return std::nullopt;
  const char *const begin = file.data() + kArrays.size(), *const end = file.data() + file.size();
  const auto read = std::from_chars(begin, end, number);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return number;
}

}  // namespace firn
