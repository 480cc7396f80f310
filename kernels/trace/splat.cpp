// SPDX-License-Identifier: MIT
// Particles -> corners: each adds its amount to the 3x3x3 corners around it, by P2G's weights.
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

namespace {
typedef float Row __attribute__((vector_size(16)));  // of corners along z, in every instruction set

FIRN_INLINE void spline(float f, float w[3]) {  // f: from the middle corner, cells, in [-1/2, 1/2]
  w[0] = 0.5f * (0.5f - f) * (0.5f - f);
  w[1] = 0.75f - f * f;
  w[2] = 0.5f * (0.5f + f) * (0.5f + f);
}
}  // namespace

void splat(const TraceGrid& grid, const int first[3], std::uint32_t begin, std::uint32_t end,
           const float* amount, float* tile) {
  const float* const position[3] = {grid.x, grid.y, grid.z};
  for (std::uint32_t s = begin; s < end; ++s) {
    float w[3][3];
    int base[3];  // of the first corner reached, in the tile
    for (int a = 0; a < 3; ++a) {
      const float p = position[a][s] * grid.inv_cell - static_cast<float>(first[a]);
      int middle = static_cast<int>(p + 0.5f);
      middle = middle < 0 ? 0 : middle > kBrickCells ? kBrickCells : middle;
      spline(p - static_cast<float>(middle), w[a]);
      base[a] = middle;
    }
    const Row wz = {w[2][0], w[2][1], w[2][2], 0};
    for (int i = 0; i < 3; ++i) {
      const float wx = w[0][i] * amount[s];
      for (int j = 0; j < 3; ++j) {
        float* at = tile + ((base[0] + i) * kFieldTileSide + base[1] + j) * kFieldTileRow + base[2];
        Row row;
        __builtin_memcpy(&row, at, sizeof row);
        row += wx * w[1][j] * wz;
        __builtin_memcpy(at, &row, sizeof row);
      }
    }
  }
}

}  // namespace firn::kernels::FIRN_ISA
