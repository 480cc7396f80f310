// SPDX-License-Identifier: MIT
// Normals of the smooth surface at points: a register of them, each in a cell of its own, the gradients at
// its corners by gathers.
#include "kernels/shade/table.h"
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

void normals(const TraceGrid& grid, const GradientField& field, const Columns3& point, std::size_t begin,
             std::size_t end, float* const normal[3]) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = static_cast<int>(end - i < kLanes ? end - i : kLanes);
    Mask inside = mask_of_first(count);
    Floats part[3];
    Ints cell[3];
    for (int a = 0; a < 3; ++a) {
      const Floats p = load_first(point.at[a] + i, count, 0.f) * grid.inv_cell;
      inside = inside & less_equal(splat(0), p) & less(p, splat(static_cast<float>(grid.cells[a])));
      const Floats held = select(inside, p, splat(0));
      cell[a] = __builtin_convertvector(held, Ints);
      part[a] = held - to_float(cell[a]);
    }
    const Ints brick = ((cell[0] >> 2) * grid.bricks[1] + (cell[1] >> 2)) * grid.bricks[2] + (cell[2] >> 2);
    const Ints slot = gather(grid.slot, brick, inside);
    inside = inside & !less(slot, splat_int(0));
    const Ints place = gather(reinterpret_cast<const std::int32_t*>(field.place), slot, inside);
    inside = inside & !equal(place, splat_int(static_cast<std::int32_t>(GradientField::kNone)));
    const Ints first = place * kBrickCorners + (cell[0] & 3) * (kCornerSide * kCornerSide) +
                       (cell[1] & 3) * kCornerSide + (cell[2] & 3);
    Floats sum[3];
    for (int a = 0; a < 3; ++a) {
      Floats corner[8];
      for (int k = 0; k < 8; ++k) {
        const int offset = (k >> 2) * kCornerSide * kCornerSide + (k >> 1 & 1) * kCornerSide + (k & 1);
        corner[k] = gather(field.value, (first + offset) * 3 + a, inside);
      }
      for (int b = 2, n = 4; b >= 0; --b, n /= 2) {  // z, then y, then x
        for (int k = 0; k < n; ++k)
          corner[k] = fma(part[b], corner[2 * k + 1] - corner[2 * k], corner[2 * k]);
      }
      sum[a] = -corner[0];
    }
    const Floats length = sqrt(fma(sum[2], sum[2], fma(sum[1], sum[1], sum[0] * sum[0])));
    const Mask there = inside & less(splat(1e-12f), length);
    for (int a = 0; a < 3; ++a) store_first(normal[a] + i, count, select(there, sum[a] / length, splat(0)));
  }
}

}  // namespace firn::kernels::FIRN_ISA
