// SPDX-License-Identifier: MIT
// Colliders as the grid feels them: signed distance and normal at the nodes of a block, evaluated in double
// once, when the block appears. Any shape with a signed distance works, with one kernel.
#pragma once
#include <vector>

#include "kernels/mpm/views.h"
#include "src/mpm/simulation.h"
#include "src/particles/blocks.h"

namespace firn {

// World position of a place in a block, given in cells from its corner; dx in metres.
inline Vec3 world_in_block(const BlockCoord& block, const Vec3& cells, double dx) {
  return (4.0 * Vec3(block.x, block.y, block.z) + cells) * dx;
}

// The colliders that some node of the block touches, in the scene's order.
std::vector<kernels::ContactNodes> contacts_of_block(const std::vector<Collider>& colliders,
                                                     const BlockCoord& block, double dx);

}  // namespace firn
