// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct RestingOptions {
  std::size_t particles = 1000000;
  int threads = 1;
  std::string isa = "auto";
  int steps = 400;
  double dt = 1e-4;  // s, halved until stable
  std::string json;  // path; empty: none
};

// Times the steps of snow of which nine tenths have come to rest, with sleep and without, and prints how many
// times cheaper sleep makes them, over the second half of the steps. Errors: usage, io, unstable.
void run_resting(const RestingOptions& options);

}  // namespace firn::bench
