// SPDX-License-Identifier: MIT
// Where particles lie: the extent of a column, and the brick and cell of each particle of a snapshot. In:
// columns of positions. Out: a code a particle, which the counting sort goes by.
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

Extent extent(const float* column, std::size_t begin, std::size_t end) {
  constexpr float kInf = __builtin_huge_valf();
  Floats low = splat(kInf), high = splat(-kInf), far = splat(0);
  const auto see = [&](Floats v, Floats least, Floats greatest) FIRN_INLINE_LAMBDA {
    low = min(low, least);
    high = max(high, greatest);
    far = far + abs(v);  // not a number if one of them is none
  };
  for (; begin + kLanes <= end; begin += kLanes) {
    const Floats v = load(column + begin);
    see(v, v, v);
  }
  if (begin < end) {
    const int some = static_cast<int>(end - begin);
    see(load_some(column + begin, some, 0.f), load_some(column + begin, some, kInf),
        load_some(column + begin, some, -kInf));
  }
  return {-largest_lane(-low), largest_lane(high), all(less(far, splat(kInf)))};
}

void cell_codes(const TraceGrid& grid, const float* const position[3], const float shift[3],
                std::size_t begin, std::size_t end, std::uint32_t* code) {
  Floats size[3], last[3];
  for (int a = 0; a < 3; ++a) {
    size[a] = splat(static_cast<float>(grid.cells[a]) * grid.cell);
    last[a] = splat(static_cast<float>(grid.cells[a] - 1));
  }
  const Ints outside = splat_int(grid.bricks[0] * grid.bricks[1] * grid.bricks[2] * kCellsPerBrick);
  for (; begin < end; begin += kLanes) {
    const int some = end - begin < kLanes ? static_cast<int>(end - begin) : kLanes;
    Mask in = all_lanes();
    Ints c[3];
    for (int a = 0; a < 3; ++a) {
      const Floats p = load_first(position[a] + begin, some, 0.f) + shift[a];
      in = in & less_equal(splat(0), p) & less(p, size[a]);
      c[a] = __builtin_convertvector(max(min(p * grid.inv_cell, last[a]), splat(0)), Ints);
    }
    const Ints brick = ((c[0] >> 2) * grid.bricks[1] + (c[1] >> 2)) * grid.bricks[2] + (c[2] >> 2);
    const Ints cell = ((c[0] & 3) << 4) + ((c[1] & 3) << 2) + (c[2] & 3);
    store_first(reinterpret_cast<std::int32_t*>(code + begin), some,
                select(in, brick * kCellsPerBrick + cell, outside));
  }
}

}  // namespace firn::kernels::FIRN_ISA
