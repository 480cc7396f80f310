// SPDX-License-Identifier: MIT
// firn-bench sphere: paths of light from both ends through a homogeneous sphere.
#pragma once
#include <string>

namespace firn::bench {

struct SphereOptions {
  int threads = 2;
  int samples = 256;  // paths a pixel
  int repeats = 3;
  std::string integrator = "bidirectional";  // or path
  std::string isa = "auto";
  std::string json;
};
void run_sphere(const SphereOptions& options);

}  // namespace firn::bench
