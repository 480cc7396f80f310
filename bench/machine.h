// SPDX-License-Identifier: MIT
// The machine that figures belong to: what it is, and what one core of it can do at most.
#pragma once
#include <string>

namespace firn::bench {

struct Machine {
  std::string cpu;   // "AMD EPYC (family 25, model 17)"
  std::string slug;  // for file names: "authenticamd-25-17"
  unsigned cores = 0;
};
Machine this_machine();

// Measured on one core with the lanes of `isa` ("x86-64-v4", ...): the best of some repeats.
struct Limits {
  double flops = 0;  // fp32 flops/s of multiply-adds, 2 flops each
  double bytes = 0;  // bytes/s, an array far larger than the caches read and written in place
};
Limits measure_limits(const std::string& isa);

}  // namespace firn::bench
