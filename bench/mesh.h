// SPDX-License-Identifier: MIT
#pragma once
#include <cstddef>
#include <string>

namespace firn::bench {

struct MeshOptions {
  std::size_t triangles = 100000;
  std::string isa = "auto";
  int repeats = 5;
  std::string json;  // path; empty: none
};

// Times rays against a bumpy ball of so many triangles, on one thread, and prints the figures. Errors: usage,
// io.
void run_mesh(const MeshOptions& options);

}  // namespace firn::bench
