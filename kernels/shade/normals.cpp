// SPDX-License-Identifier: MIT
// Normals of the smooth surface at points: a register of them at a time, from the gradients at the corners of
// their cells.
#include "kernels/shade/table.h"
#include "kernels/trace/corners.h"

namespace firn::kernels::FIRN_ISA {

void normals(const TraceGrid& grid, const GradientField& field, const Columns3& point, std::size_t begin,
             std::size_t end, float* const normal[3]) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = static_cast<int>(end - i < kLanes ? end - i : kLanes);
    Floats p[3];
    for (int a = 0; a < 3; ++a) p[a] = load_first(point.at[a] + i, count, 0.f);
    const CellPoints points(grid, p, mask_of_first(count));
    const Ints place = gather(reinterpret_cast<const std::int32_t*>(field.place), points.slot, points.inside);
    const Mask inside =
        points.inside & !equal(place, splat_int(static_cast<std::int32_t>(GradientField::kNone)));
    const Corners corners = points.corners(place);
    Floats sum[3];
    for (int a = 0; a < 3; ++a) sum[a] = -corners.of<3>(field.value + a, inside);
    const Floats length = sqrt(fma(sum[2], sum[2], fma(sum[1], sum[1], sum[0] * sum[0])));
    const Mask there = inside & less(splat(1e-12f), length);
    for (int a = 0; a < 3; ++a) store_first(normal[a] + i, count, select(there, sum[a] / length, splat(0)));
  }
}

}  // namespace firn::kernels::FIRN_ISA
