// SPDX-License-Identifier: MIT
// A ray's way through the cells: entry into the grid, steps from cell to cell, leaps over empty bricks.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

// Moves the ray's origin to where it enters the grid, `entry` metres on. False if it misses within `reach`.
inline bool enter_grid(const TraceGrid& grid, Ray& ray, float reach, double& entry) {
  double t_in = 0, t_out = reach;
  for (int a = 0; a < 3; ++a) {
    const double size = static_cast<double>(grid.cell) * grid.cells[a], o = ray.o[a], d = ray.d[a];
    if (d == 0) {
      if (o < 0 || o > size) return false;
      continue;
    }
    const double inv = 1 / d;
    const double t0 = (d > 0 ? -o : size - o) * inv, t1 = (d > 0 ? size - o : -o) * inv;
    if (t0 > t_in) t_in = t0;
    if (t1 < t_out) t_out = t1;
  }
  if (!(t_in <= t_out) || grid.cells[0] == 0) return false;
  for (int a = 0; a < 3; ++a) ray.o[a] = static_cast<float>(ray.o[a] + t_in * ray.d[a]);
  entry = t_in;
  return true;
}

FIRN_INLINE std::size_t brick_at(const TraceGrid& grid, int x, int y, int z) {
  return (static_cast<std::size_t>(x) * grid.bricks[1] + y) * grid.bricks[2] + z;
}
// The cell's place in cell_start and bundle_start.
FIRN_INLINE std::size_t cell_at(std::uint32_t slot, int x, int y, int z) {
  return static_cast<std::size_t>(slot) * kCellsPerBrick + ((x & 3) << 4) + ((y & 3) << 2) + (z & 3);
}

class CellWalk {
 public:
  CellWalk(const TraceGrid& grid, const Ray& ray) : grid_(grid), ray_(ray) {
    for (int a = 0; a < 3; ++a) {
      forward_[a] = ray.d[a] >= 0;
      inv_[a] = ray.d[a] == 0 ? kFar : 1 / ray.d[a];
      cell_[a] = clamp(static_cast<int>(ray.o[a] * grid.inv_cell), 0, grid.cells[a] - 1);
      aim(a);
    }
  }

  std::size_t brick() const { return brick_at(grid_, cell_[0] >> 2, cell_[1] >> 2, cell_[2] >> 2); }
  const int* cell() const { return cell_; }
  std::size_t cell_in(std::uint32_t slot) const { return cell_at(slot, cell_[0], cell_[1], cell_[2]); }

  // On to the next cell; false at the grid's end or when the present cell reaches beyond `reach`.
  bool step(float reach) {
    const int a = nearest_axis(next_);
    if (next_[a] >= reach) return false;
    cell_[a] += forward_[a] ? 1 : -1;
    if (static_cast<unsigned>(cell_[a]) >= static_cast<unsigned>(grid_.cells[a])) return false;
    aim(a);
    return true;
  }

  // Out of the cube of empty bricks within `clearance` of this one.
  bool leap(int clearance, float reach) {
    int low[3], high[3];
    float exit[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = ((cell_[a] >> 2) - clearance + 1) * kBrickCells;
      high[a] = ((cell_[a] >> 2) + clearance) * kBrickCells;
      exit[a] = plane_distance(a, forward_[a] ? high[a] : low[a]);
    }
    const int out = nearest_axis(exit);
    const float t = exit[out];
    if (t >= reach) return false;
    for (int a = 0; a < 3; ++a) {
      if (a == out) {
        cell_[a] = forward_[a] ? high[a] : low[a] - 1;
        if (static_cast<unsigned>(cell_[a]) >= static_cast<unsigned>(grid_.cells[a])) return false;
      } else {
        const int there = static_cast<int>((ray_.o[a] + t * ray_.d[a]) * grid_.inv_cell);
        const int ahead = clamp(there, forward_[a] ? cell_[a] : low[a], forward_[a] ? high[a] - 1 : cell_[a]);
        cell_[a] = clamp(ahead, 0, grid_.cells[a] - 1);
      }
    }
    for (int a = 0; a < 3; ++a) aim(a);
    return true;
  }

 private:
  static constexpr float kFar = 3e38f;
  static int clamp(int v, int low, int high) { return v < low ? low : v > high ? high : v; }
  static int nearest_axis(const float t[3]) {
    return t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : (t[1] < t[2] ? 1 : 2);
  }

  float plane_distance(int a, int plane) const {
    if (inv_[a] == kFar) return kFar;
    return (static_cast<float>(plane) * grid_.cell - ray_.o[a]) * inv_[a];
  }
  void aim(int a) { next_[a] = plane_distance(a, cell_[a] + (forward_[a] ? 1 : 0)); }

  const TraceGrid& grid_;
  const Ray& ray_;
  bool forward_[3];
  float inv_[3];  // 1/m-ish: 1 / direction
  int cell_[3];
  float next_[3];  // m, to the next plane of each axis
};

}  // namespace firn::kernels::FIRN_ISA
