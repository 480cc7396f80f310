// SPDX-License-Identifier: MIT
// "did you mean": what other programs call so, or else the known name that is fewest typing errors away.
#pragma once
#include <string>
#include <vector>

namespace firn {

// ", did you mean 'radius'?" or nothing when no name is near.
std::string suggestion(const std::string& word, const std::vector<std::string>& names);

// Insertions, deletions, replacements and swaps of neighbours (optimal string alignment distance).
int edit_distance(const std::string& a, const std::string& b);

}  // namespace firn
