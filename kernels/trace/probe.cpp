// SPDX-License-Identifier: MIT
// A field of the snow at points: a register of them at a time, each in a cell of its own, the corners of its
// cell by gathers. What shading asks for many points at once: how much snow lies before and behind them.
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

void probe(const TraceGrid& grid, const float* field, const ProbeView& probes, float distance,
           std::size_t begin, std::size_t end, float* value) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = static_cast<int>(end - i < kLanes ? end - i : kLanes);
    Mask inside = mask_of_first(count);
    Floats part[3];
    Ints cell[3];
    for (int a = 0; a < 3; ++a) {
      const Floats p = fma(splat(distance), load_first(probes.direction[a] + i, count, 0.f),
                           load_first(probes.origin[a] + i, count, 0.f)) *
                       grid.inv_cell;
      const Floats cells = splat(static_cast<float>(grid.cells[a]));
      inside = inside & less_equal(splat(0), p) & less(p, cells);
      const Floats held = select(inside, p, splat(0));
      cell[a] = __builtin_convertvector(held, Ints);
      part[a] = held - to_float(cell[a]);
    }
    const Ints brick = ((cell[0] >> 2) * grid.bricks[1] + (cell[1] >> 2)) * grid.bricks[2] + (cell[2] >> 2);
    const Ints slot = gather(grid.slot, brick, inside);
    inside = inside & !less(slot, splat_int(0));
    if (!any(inside)) {  // before the snow, where half of all points are
      store_first(value + i, count, splat(0));
      continue;
    }
    const Ints first = slot * kBrickCorners + (cell[0] & 3) * (kCornerSide * kCornerSide) +
                       (cell[1] & 3) * kCornerSide + (cell[2] & 3);
    Floats corner[8];
    for (int k = 0; k < 8; ++k) {
      const int offset = (k >> 2) * kCornerSide * kCornerSide + (k >> 1 & 1) * kCornerSide + (k & 1);
      corner[k] = gather(field, first + offset, inside);
    }
    for (int a = 2, n = 4; a >= 0; --a, n /= 2) {  // z, then y, then x
      for (int k = 0; k < n; ++k) corner[k] = fma(part[a], corner[2 * k + 1] - corner[2 * k], corner[2 * k]);
    }
    store_first(value + i, count, select(inside, corner[0], splat(0)));
  }
}

}  // namespace firn::kernels::FIRN_ISA
