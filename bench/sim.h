// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct SimOptions {
  std::string scene = "impact";  // bench/scene.h
  std::size_t particles = 1000000;
  int threads = 1;
  std::string isa = "auto";
  int steps = 400;
  double dt = 1e-4;         // s, halved until stable
  bool naive = true;        // run the baseline beside firn
  bool stop_early = false;  // its SVD ends when converged; else after five sweeps
  std::string json;         // path; empty: none
};

// Times firn's step and, over the same steps, the baseline's (always one thread), and prints the means over
// the second half of the steps. Errors: usage, io.
void run_sim(const SimOptions& options);

}  // namespace firn::bench
