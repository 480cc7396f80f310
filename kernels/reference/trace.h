// SPDX-License-Identifier: MIT
// The trace kernels as they are meant: every ray against every ball, in plain double. The oracle of
// tests/trace.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/trace/table.h"

namespace firn::kernels::reference {

struct Meeting {
  bool exists = false;  // the line comes within the ball's radius
  double t = 0;  // m, where the ray enters the ball (negative: behind the origin, or the origin is inside)
  double depth2 = 0;  // m^2, r^2 - |q|^2: near 0 the ray grazes
};
// One ray of unit direction d against one ball.
Meeting meet(const double o[3], const double d[3], const double center[3], double radius);

// As TraceKernels, over all `count` balls of the grid's columns.
void closest(const TraceGrid& grid, std::size_t count, const RayView& rays, std::size_t begin,
             std::size_t end);
void occluded(const TraceGrid& grid, std::size_t count, const RayView& rays, std::size_t begin,
              std::size_t end);

// The integral of the extinction along a ray of unit direction d from t = from to t = to (m), which may be
// infinite: the mean number of collisions that `collide` would find if rays went on. The `count` balls in
// the cells, the first of the columns, and the strays. Between the faces of cells and of balls the density is
// a cubic, for which Simpson's rule is exact; cells that the surface crosses are cut in 64. No number if the
// ray is in more than 1024 balls, one after another.
double optical_depth(const TraceGrid& grid, const MediumField& field, std::size_t count, const double o[3],
                     const double d[3], double from, double to);

// As TraceKernels::probe, at one point: the sum over the eight corners of its cell.
double probe(const TraceGrid& grid, const float* field, const double p[3]);

}  // namespace firn::kernels::reference
