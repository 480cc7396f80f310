// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct SimOptions {
  std::size_t particles = 1000000;
  int threads = 1;
  std::string isa = "auto";
  int steps = 400;
  std::string json;  // path; empty: none
};

// Times the stages of the simulation step and prints ns a particle of each. Errors: usage, io.
void run_sim(const SimOptions& options);

}  // namespace firn::bench
