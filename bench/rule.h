// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct RuleOptions {
  std::size_t particles = 1000000;
  std::string shape = "ball";  // bench/trace_scene.h
  double radius = 0.6;         // of a ball, in lattice spacings
  std::string isa = "auto";
  int repeats = 5;
  std::string json;  // path; empty: none
};

// Times each way in which rays can go through the snow, from pixels of a sixteenth of a spacing to such of
// eight, beside the way that the rule takes; on one thread. Errors: usage, io.
void run_rule(const RuleOptions& options);

}  // namespace firn::bench
