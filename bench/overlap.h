// SPDX-License-Identifier: MIT
// firn-bench overlap: whole runs with frames that overlap, and one frame after another.
#pragma once
#include <string>

namespace firn::bench {

struct OverlapOptions {
  int threads = 2;
  int repeats = 3;
  std::string firn;               // the program; empty: that of this build
  std::string scenes = "scenes";  // folder of the scene files
  std::string isa = "auto";
  std::string json;
};
// False if the frames are not the same to the bit. Errors: usage and io.
bool run_overlap(const OverlapOptions& options);

}  // namespace firn::bench
