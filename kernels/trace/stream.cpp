// SPDX-License-Identifier: MIT
// Incoherent rays, one after the other: each walks the grid (leaping through empty bricks by their clearance,
// then cell by cell, Amanatides & Woo 1987) and tests the balls of a cell 16 at a time. In: grid, rays. Out:
// distance and particle per ray. A ray is first moved to the grid's edge in double, so that a far camera
// costs no precision. Every step crosses a plane of the grid for good: the walk always ends.
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {
namespace {

// A cell of a core brick: every ball that can overlap it has its centre within the largest radius of it.
void test_around(const TraceGrid& grid, const int cell[3], const Ray& ray, Nearest& best) {
  const int reach = static_cast<int>(grid.max_radius * grid.inv_cell) + 1;
  int low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    low[a] = cell[a] > reach ? cell[a] - reach : 0;
    high[a] = cell[a] + reach < grid.cells[a] ? cell[a] + reach : grid.cells[a] - 1;
  }
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const std::uint32_t slot = grid.slot[brick_at(grid, x >> 2, y >> 2, z >> 2)];
        if (slot == kNoBrick) continue;
        const std::size_t place = cell_at(slot, x, y, z);
        test_run(grid, grid.cell_start[place], grid.cell_start[place + 1], ray, best);
      }
    }
  }
}

template <bool kAny>
void trace_ray(const TraceGrid& grid, const RayView& rays, std::size_t i) {
  Ray ray = load_ray(rays, i);
  Nearest best{rays.t[i], kNoHit};
  test_bundles<kAny>(grid.strays, 0, grid.stray_bundles, ray, best);
  double entry = 0;
  if (!(kAny && best.particle != kNoHit) && enter_grid(grid, ray, best.t, entry)) {
    Nearest inside{static_cast<float>(best.t - entry), kNoHit};
    CellWalk walk(grid, ray);
    do {
      const std::uint32_t slot = grid.slot[walk.brick()];
      if (slot == kNoBrick) {
        if (!walk.leap(grid.clearance[walk.brick()], inside.t)) break;
        continue;
      }
      if (grid.core[slot]) {
        test_around(grid, walk.cell(), ray, inside);
      } else {
        const std::size_t cell = walk.cell_in(slot);
        test_bundles<kAny>(grid.bundles, grid.bundle_start[cell], grid.bundle_start[cell + 1], ray, inside);
      }
      if (kAny && inside.particle != kNoHit) break;
    } while (walk.step(inside.t));
    if (inside.particle != kNoHit) best = {static_cast<float>(entry + inside.t), inside.particle};
  }
  rays.hit[i] = best.particle;
  if (!kAny) rays.t[i] = best.t;
}

}  // namespace

void closest(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) trace_ray<false>(grid, rays, i);
}

void occluded(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) trace_ray<true>(grid, rays, i);
}

}  // namespace firn::kernels::FIRN_ISA
