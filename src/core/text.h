// SPDX-License-Identifier: MIT
// Words as people and files spell them.
#pragma once
#include <string>

namespace firn {

std::string lower_case(std::string text);  // A to Z only, whatever the locale
// Control characters as \x1b, for they would break the line or draw on the terminal.
std::string escape_control(const std::string& text);

}  // namespace firn
