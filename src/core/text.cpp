// SPDX-License-Identifier: MIT
#include "src/core/text.h"

#include <cstdio>

namespace firn {

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return text;
}

std::string escape_control(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    char escape[8];
    std::snprintf(escape, sizeof escape, "\\x%02x", code);
    line += code < ' ' || code == 0x7F ? std::string(escape) : std::string(1, c);
  }
  return line;
}

std::string frame_list(const std::vector<int>& frames) {
  std::string list;
  for (std::size_t i = 0; i < frames.size();) {
    std::size_t end = i + 1;
    while (end < frames.size() && frames[end] == frames[end - 1] + 1) ++end;
    if (i > 0) list += ", ";
    list += std::to_string(frames[i]);
    if (end > i + 1) list.append("-").append(std::to_string(frames[end - 1]));
    i = end;
  }
  return list;
}

std::string grouped(std::uint64_t number) {
  std::string digits = std::to_string(number);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), 1, ',');
  return digits;
}

}  // namespace firn
