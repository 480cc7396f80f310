// SPDX-License-Identifier: MIT
// Words as people and files spell them.
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace firn {

// printf's, of at most 255 characters.
template <class... Values>
std::string text(const char* format, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

std::string lower_case(std::string text);  // A to Z only, whatever the locale
// Control characters as \x1b, for they would break the line or draw on the terminal.
std::string escape_control(const std::string& text);

std::string frame_list(const std::vector<int>& frames);  // ascending: "0, 3-5"
std::string grouped(std::uint64_t number);               // 1234567 -> "1,234,567"

}  // namespace firn
