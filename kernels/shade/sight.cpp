// SPDX-License-Identifier: MIT
// Camera rays through the middles of pixels, in double: a far camera sees the snow in a narrow cone.
#include "kernels/shade/table.h"
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

void sights(const Pinhole& camera, const std::int32_t* x, const std::int32_t* y, std::size_t begin,
            std::size_t end, float* const direction[3], float* spread) {
  for (std::size_t i = begin; i < end; ++i) {
    const double right = camera.pixel * (x[i] + 0.5 - camera.center[0]),
                 down = camera.pixel * (y[i] + 0.5 - camera.center[1]);
    double through[3], length2 = 0;
    for (int a = 0; a < 3; ++a) {
      through[a] = camera.forward[a] + (right * camera.right[a] + down * camera.down[a]);
      length2 += through[a] * through[a];
    }
    const double cosine = 1 / __builtin_sqrt(length2);
    for (int a = 0; a < 3; ++a) direction[a][i] = static_cast<float>(through[a] * cosine);
    spread[i] = static_cast<float>(0.5 * camera.pixel * cosine * __builtin_sqrt(cosine));
  }
}

}  // namespace firn::kernels::FIRN_ISA
