// SPDX-License-Identifier: MIT
// Particles -> tiles of corners -> corners. Each particle adds its amount to the 3x3x3 corners around it, by
// P2G's weights: those of a register of particles at a time, then their rows one after another, in the order
// of the particles. Then each brick sums the tiles that reach its corners. Rows are read and written whole,
// eight corners each, whichever of them a particle reaches: a read that overlaps the write before it by half
// would have to wait for the cache.
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

namespace {
// Corners along z, in every instruction set.
typedef float Row __attribute__((vector_size(4 * kFieldTileRow)));
typedef std::int32_t RowPlaces __attribute__((vector_size(4 * kFieldTileRow)));
constexpr RowPlaces kPlaces = {0, 1, 2, 3, 4, 5, 6, 7};

FIRN_INLINE Row load_row(const float* p) {
  Row row;
  __builtin_memcpy(&row, p, sizeof row);
  return row;
}
FIRN_INLINE void store_row(float* p, Row row) { __builtin_memcpy(p, &row, sizeof row); }

// f: from the middle corner, cells, in [-1/2, 1/2].
FIRN_INLINE void spline(Floats f, Floats w[3]) {
  w[0] = 0.5f * (0.5f - f) * (0.5f - f);
  w[1] = 0.75f - f * f;
  w[2] = 0.5f * (0.5f + f) * (0.5f + f);
}

// What each particle adds: by the corners' places along x and y, and along z.
struct Weights {
  alignas(64) float xy[9][kLanes], z[3][kLanes];
  alignas(64) std::int32_t row[kLanes], place[kLanes];  // the first row in the tile, and the place in it
  int some;                                             // a bit for each particle that adds something
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
  out.some = lane_bits(less(splat(0), each));
  for (int i = 0; i < 3; ++i) {
    const Floats wx = w[0][i] * each;
    for (int j = 0; j < 3; ++j) store(out.xy[3 * i + j], wx * w[1][j]);
    store(out.z[i], w[2][i]);
  }
  store(out.row, (base[0] * kFieldTileSide + base[1]) * kFieldTileRow);
  store(out.place, base[2]);
}
}  // namespace

void splat(const TraceGrid& grid, const int first[3], std::uint32_t begin, std::uint32_t end,
           const float* amount, float* tile) {
  Weights w;
  for (std::uint32_t s = begin; s < end; s += kLanes) {
    const int count = static_cast<int>(end - s < kLanes ? end - s : kLanes);
    weigh(grid, first, s, count, amount, w);
    for (int some = w.some; some != 0; some &= some - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(some));
      const Row three = {w.z[0][lane], w.z[1][lane], w.z[2][lane]};
      const RowPlaces from = (kPlaces - w.place[lane]) & (kFieldTileRow - 1);
      const Row wz = permute(three, from);
      float* rows = tile + w.row[lane];
#pragma GCC unroll 9
      for (int k = 0; k < 9; ++k) {
        float* at = rows + (k / 3 * kFieldTileSide + k % 3) * kFieldTileRow;
        store_row(at, load_row(at) + w.xy[k][lane] * wz);
      }
    }
  }
}

namespace {
// The corners of a brick that lie beside one another along z, in the first places of a row each.
typedef Row Corners[kCornerSide][kCornerSide];

// What a row of the tile of the brick at this step along z holds for each corner; the last corners are not
// used by particles.
template <int step>
FIRN_INLINE Row of_corners(Row row) {
  const Row zero = {};
  if constexpr (step < 0) {
    return __builtin_shufflevector(row, zero, 5, 6, 8, 8, 8, 8, 8, 8);
  } else if constexpr (step == 0) {
    return __builtin_shufflevector(row, zero, 1, 2, 3, 4, 5, 8, 8, 8);
  } else {
    return __builtin_shufflevector(row, zero, 8, 8, 8, 0, 1, 8, 8, 8);
  }
}

// What the tile of the brick at step k holds: all that depends on the step is known to the compiler.
template <int k>
FIRN_INLINE void add_tile(const float* tile, Corners& sum) {
  constexpr int kStep[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
  constexpr int kLow[2] = {kStep[0] > 0 ? kBrickCells - 1 : 0, kStep[1] > 0 ? kBrickCells - 1 : 0};
  constexpr int kHigh[2] = {kStep[0] < 0 ? 1 : kBrickCells, kStep[1] < 0 ? 1 : kBrickCells};
#pragma GCC unroll 5
  for (int x = kLow[0]; x <= kHigh[0]; ++x) {
#pragma GCC unroll 5
    for (int y = kLow[1]; y <= kHigh[1]; ++y) {
      const int row = (x - kBrickCells * kStep[0] + 1) * kFieldTileSide + y - kBrickCells * kStep[1] + 1;
      sum[x][y] += of_corners<kStep[2]>(load_row(tile + row * kFieldTileRow));
    }
  }
}

template <int k = 0>
FIRN_INLINE void add_tiles(const float* const tiles[27], Corners& sum) {
  if (tiles[k] != nullptr) add_tile<k>(tiles[k], sum);
  if constexpr (k + 1 < 27) add_tiles<k + 1>(tiles, sum);
}
}  // namespace

void sum_tiles(const float* const tiles[27], float* corners) {
  Corners sum;
  for (int x = 0; x < kCornerSide; ++x) {
    for (int y = 0; y < kCornerSide; ++y) {
      sum[x][y] = Row{};
      __builtin_memcpy(&sum[x][y], corners + (x * kCornerSide + y) * kCornerSide, 4 * kCornerSide);
    }
  }
  add_tiles(tiles, sum);
  for (int x = 0; x < kCornerSide; ++x) {
    for (int y = 0; y < kCornerSide; ++y)
      __builtin_memcpy(corners + (x * kCornerSide + y) * kCornerSide, &sum[x][y], 4 * kCornerSide);
  }
}

}  // namespace firn::kernels::FIRN_ISA
