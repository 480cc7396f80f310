// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct MediumOptions {
  std::size_t particles = 1000000;
  std::string isa = "auto";
  std::string json;  // path; empty: none
};

// Times flights of light through a ball of snow, from collision to collision, on one thread, and prints the
// figures. Errors: usage, io.
void run_medium(const MediumOptions& options);

}  // namespace firn::bench
