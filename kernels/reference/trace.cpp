// SPDX-License-Identifier: MIT
#include "kernels/reference/trace.h"

#include <cmath>

namespace firn::kernels::reference {

Meeting meet(const double o[3], const double d[3], const double center[3], double radius) {
  const double c[3] = {center[0] - o[0], center[1] - o[1], center[2] - o[2]};
  const double along = c[0] * d[0] + c[1] * d[1] + c[2] * d[2];
  double q2 = 0;
  for (int a = 0; a < 3; ++a) q2 += (c[a] - along * d[a]) * (c[a] - along * d[a]);
  const double depth2 = radius * radius - q2;
  return {depth2 >= 0, depth2 >= 0 ? along - std::sqrt(depth2) : along, depth2};
}

void closest(const TraceGrid& grid, std::size_t count, const RayView& rays, std::size_t begin,
             std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    const double o[3] = {rays.origin[0][i], rays.origin[1][i], rays.origin[2][i]};
    const double d[3] = {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]};
    double best = rays.t[i];
    rays.hit[i] = kNoHit;
    for (std::size_t p = 0; p < count; ++p) {
      const double center[3] = {grid.x[p], grid.y[p], grid.z[p]};
      const Meeting meeting = meet(o, d, center, grid.radius[p]);
      if (!meeting.exists || !(meeting.t > 0) || !(meeting.t < best)) continue;
      best = meeting.t;
      rays.hit[i] = static_cast<std::uint32_t>(p);
    }
    rays.t[i] = static_cast<float>(best);
  }
}

void occluded(const TraceGrid& grid, std::size_t count, const RayView& rays, std::size_t begin,
              std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    const float reach = rays.t[i];
    closest(grid, count, rays, i, i + 1);
    rays.t[i] = reach;
  }
}

double probe(const TraceGrid& grid, const float* field, const double p[3]) {
  int cell[3];
  double part[3];
  for (int a = 0; a < 3; ++a) {
    const double at = p[a] / grid.cell;
    if (!(at >= 0 && at < grid.cells[a])) return 0;
    cell[a] = static_cast<int>(at);
    part[a] = at - cell[a];
  }
  const std::size_t brick =
      (static_cast<std::size_t>(cell[0] / kBrickCells) * grid.bricks[1] + cell[1] / kBrickCells) *
          grid.bricks[2] +
      cell[2] / kBrickCells;
  if (grid.slot[brick] < 0) return 0;
  double sum = 0;
  for (int k = 0; k < 8; ++k) {
    const int step[3] = {k >> 2, k >> 1 & 1, k & 1};
    double weight = 1;
    int corner = 0;
    for (int a = 0; a < 3; ++a) {
      weight *= step[a] ? part[a] : 1 - part[a];
      corner = corner * kCornerSide + cell[a] % kBrickCells + step[a];
    }
    sum += weight * field[static_cast<std::size_t>(grid.slot[brick]) * kBrickCorners + corner];
  }
  return sum;
}

}  // namespace firn::kernels::reference
