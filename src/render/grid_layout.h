// SPDX-License-Identifier: MIT
// How large the cells of a frame's render grid are and where they lie: Snapshot -> ball radii, bounds ->
// cells. The cell follows the mean particle spacing. It grows only when the table of bricks or the list of
// strays would have no bound, and a few particles that flew far away do not make it grow.
#pragma once
#include <vector>

#include "src/particles/snapshot.h"
#include "src/render/setup.h"

namespace firn {

struct GridLayout {
  Vec3 origin = Vec3::Zero();  // m, world place of the render space's 0: the lower corner of the cells
  double spacing = 1;          // m, mean particle spacing
  double cell = 1;             // m
  int bricks[3] = {0, 0, 0};   // of 4x4x4 cells
  std::vector<float> radius;   // m, of each particle's ball, in snapshot order

  Vec3f local(const Snapshot& snapshot, std::size_t i) const {
    return (snapshot.world_position(i) - origin).cast<float>();
  }
  // Whether a ball belongs into the cells; else it is a stray: too large or too far.
  bool holds(const Vec3f& local, float ball_radius) const;
};

// An unstable Error if a position or volume is not finite.
GridLayout lay_out_grid(const Snapshot& snapshot, const std::vector<SnowLook>& looks);

}  // namespace firn
