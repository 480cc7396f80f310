// SPDX-License-Identifier: MIT
// A field of the snow at points, a register of them at a time: what shading asks for many points at once, how
// much snow lies before and behind them.
#include "kernels/trace/corners.h"

namespace firn::kernels::FIRN_ISA {

void probe(const TraceGrid& grid, const float* field, const ProbeView& probes, float distance,
           std::size_t begin, std::size_t end, float* value) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = static_cast<int>(end - i < kLanes ? end - i : kLanes);
    Floats p[3];
    for (int a = 0; a < 3; ++a)
      p[a] = fma(splat(distance), load_first(probes.direction[a] + i, count, 0.f),
                 load_first(probes.origin[a] + i, count, 0.f));
    const CellPoints points(grid, p, mask_of_first(count));
    Floats its = splat(0);
    if (any(points.inside)) its = points.corners(points.slot).of(field, points.inside);  // half are outside
    store_first(value + i, count, select(points.inside, its, splat(0)));
  }
}

}  // namespace firn::kernels::FIRN_ISA
