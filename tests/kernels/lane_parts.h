// SPDX-License-Identifier: MIT
// Inner parts of the kernels that no table offers, compiled once per instruction set for their tests.
#pragma once
#include "kernels/table.h"

namespace firn::kernels {

struct LaneParts {
  // Columns xx yy zz xy xz yz of `count` symmetric matrices, a multiple of 16 -> eigenvalues, ascending.
  void (*eigenvalues)(const float* const a[6], std::size_t count, float* const out[3]);
  // MpmKernels::project that decomposes every F instead of asking first whether it yields.
  int (*project_all)(const MaterialParams* materials, const ParticleView&, ParticleRange);
};

namespace isa_base {
LaneParts lane_parts();
}
namespace isa_v3 {
LaneParts lane_parts();
}
namespace isa_v4 {
LaneParts lane_parts();
}

}  // namespace firn::kernels

namespace firn::test {

kernels::LaneParts lane_parts_of(const kernels::KernelTable& table);

}  // namespace firn::test
