// SPDX-License-Identifier: MIT
// Incoherent rays against balls.
#include "kernels/trace/stream.h"
#include "kernels/trace/ball_cells.h"

namespace firn::kernels::FIRN_ISA {
void closest(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Stream<false, BallCells<false>>(grid, rays, begin, end, {grid}).run();
}

void occluded(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Stream<true, BallCells<true>>(grid, rays, begin, end, {grid}).run();
}

}  // namespace firn::kernels::FIRN_ISA
