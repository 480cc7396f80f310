// SPDX-License-Identifier: MIT
// Tables of reference values that the light is held against: tests/light/reference/README.md says where each
// is from.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace firn::test {

// The rows of tests/light/reference/NAME.csv, by the names in its first line.
std::vector<std::map<std::string, std::string>> reference_table(const std::string& name);

}  // namespace firn::test
