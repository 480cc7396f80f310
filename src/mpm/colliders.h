// SPDX-License-Identifier: MIT
// Colliders as the grid feels them: signed distance and normal at the nodes of a block, in double. Of
// colliders that stand they are evaluated once, when the block appears; of those that move, in every step,
// for the blocks that they touch and that are awake. Any shape with a signed distance works, with one kernel.
#pragma once
#include <vector>

#include "kernels/mpm/views.h"
#include "src/mpm/contact_forces.h"
#include "src/mpm/solver.h"
#include "src/particles/blocks.h"

namespace firn {

// World position of a place in a block, given in cells from its corner; dx in metres.
inline Vec3 world_in_block(const BlockCoord& block, const Vec3& cells, double dx) {
  return (4.0 * Vec3(block.x, block.y, block.z) + cells) * dx;
}

// m; about which the collider turns, and about which its torque is told: of one that stands, the place that
// its shape is put at.
Vec3 pivot_of(const Collider& collider, double time);

// What kernels summed over a block for one collider (kernels::kImpulseParts numbers), which are set to 0.
Impulse take_impulse(double* sums, const BlockCoord& block, double dx);

// The colliders without a motion that some node of the block touches, in the scene's order.
std::vector<kernels::ContactNodes> contacts_of_block(const std::vector<Collider>& colliders,
                                                     const BlockCoord& block, double dx);

// A collider with a motion during one step: where it is at the step's end, and the mean velocity that leads
// there, so that what it pushes ends the step beside it.
struct MovingCollider {
  const Collider* collider;
  std::int32_t index;  // among the scene's colliders
  Shape shape;
  Bounds bounds;  // of `shape`
  RigidVelocity velocity;
};
std::vector<MovingCollider> moving_colliders(const std::vector<Collider>& colliders, double begin,
                                             double end);
std::vector<kernels::ContactNodes> contacts_of_block(const std::vector<MovingCollider>& moving,
                                                     const BlockCoord& block, double dx);

// Could it touch a node that particles of the block touch? Yes if in doubt.
bool touched_by(const MovingCollider& moving, const BlockCoord& block, double dx);

// Bounds over begin..end (s) of the speed (m/s) and the way (m) of the collider where it can meet snow.
double speed_where_snow_is(const Collider& collider, const Bounds& snow, double begin, double end);
double way_where_snow_is(const Collider& collider, const Bounds& snow, double begin, double end);

}  // namespace firn
