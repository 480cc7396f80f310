// SPDX-License-Identifier: MIT
// Particles -> corners: each adds its amount to the 3x3x3 corners around it, by P2G's weights. The weights of
// a register of particles at a time, then their rows one after another, in the order of the particles.
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

namespace {
typedef float Row __attribute__((vector_size(16)));  // of corners along z, in every instruction set

// f: from the middle corner, cells, in [-1/2, 1/2].
FIRN_INLINE void spline(Floats f, Floats w[3]) {
  w[0] = 0.5f * (0.5f - f) * (0.5f - f);
  w[1] = 0.75f - f * f;
  w[2] = 0.5f * (0.5f + f) * (0.5f + f);
}

// What each particle adds: by the corners' places along x and y, and along z.
struct Weights {
  alignas(64) float xy[9][kLanes], z[3][kLanes];
  alignas(64) std::int32_t first[kLanes];  // corner, in the tile
};

FIRN_INLINE void weigh(const TraceGrid& grid, const int first[3], std::uint32_t begin, int count,
                       const float* amount, Weights& out) {
  const float* const position[3] = {grid.x, grid.y, grid.z};
  Floats w[3][3];
  Ints base[3];
  for (int a = 0; a < 3; ++a) {
    const Floats p =
        load_first(position[a] + begin, count, 0.f) * grid.inv_cell - static_cast<float>(first[a]);
    const Ints middle = __builtin_convertvector(p + 0.5f, Ints);
    base[a] = min(max(middle, splat_int(0)), splat_int(kBrickCells));
    spline(p - to_float(base[a]), w[a]);
  }
  const Floats each = load_first(amount + begin, count, 0.f);
  for (int i = 0; i < 3; ++i) {
    const Floats wx = w[0][i] * each;
    for (int j = 0; j < 3; ++j) store(out.xy[3 * i + j], wx * w[1][j]);
    store(out.z[i], w[2][i]);
  }
  store(out.first, (base[0] * kFieldTileSide + base[1]) * kFieldTileRow + base[2]);
}
}  // namespace

void splat(const TraceGrid& grid, const int first[3], std::uint32_t begin, std::uint32_t end,
           const float* amount, float* tile) {
  Weights w;
  for (std::uint32_t s = begin; s < end; s += kLanes) {
    const int count = static_cast<int>(end - s < kLanes ? end - s : kLanes);
    weigh(grid, first, s, count, amount, w);
    for (int lane = 0; lane < count; ++lane) {
      const Row wz = {w.z[0][lane], w.z[1][lane], w.z[2][lane], 0};
      float* corners = tile + w.first[lane];
#pragma GCC unroll 9
      for (int k = 0; k < 9; ++k) {
        float* at = corners + (k / 3 * kFieldTileSide + k % 3) * kFieldTileRow;
        Row row;
        __builtin_memcpy(&row, at, sizeof row);
        row += w.xy[k][lane] * wz;
        __builtin_memcpy(at, &row, sizeof row);
      }
    }
  }
}

}  // namespace firn::kernels::FIRN_ISA
