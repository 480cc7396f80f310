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

}  // namespace firn
