// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct KernelOptions {
  std::size_t particles = 1000000;
  std::string isa = "auto";
  std::string json;  // path; empty: none
};

// Times every kernel of the step by itself, on one thread, on snow in the middle of an impact. Errors: usage,
// io.
void run_kernels(const KernelOptions& options);

}  // namespace firn::bench
