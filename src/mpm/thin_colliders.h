// SPDX-License-Identifier: MIT
// Colliders so thin that the grid cannot part what lies on their two sides: a node beyond them belongs to the
// snow on this side too. Their particles are watched one by one: none ends a step on the other side of the
// surface that it met on its way. Stomakhin et al. 2013, section 8, let particles collide as well as nodes.
#pragma once
#include <vector>

#include "src/mpm/colliders.h"

namespace firn {

// m, across the thinnest part of the shape as far as it can be told: of a mesh twice its volume over its
// area, which is that of a plate. 1e300 for what has no other side.
double thickness(const Shape& shape);

// A thin collider during one step.
struct ThinCollider {
  const Collider* collider;
  std::size_t index;  // among the scene's colliders
  Shape before, after;
  Bounds bounds;  // of both
  RigidVelocity velocity;
};

// Indices of those thinner than two cells; and where they are from `begin` to `end` (s).
std::vector<std::size_t> find_thin(const std::vector<Collider>& colliders, double dx);
std::vector<ThinCollider> thin_colliders(const std::vector<Collider>& colliders,
                                         const std::vector<std::size_t>& thin, double begin, double end);

// A particle goes from x to y (m) in the step. If the collider's surface is in its way, y and its velocity v
// (m/s) change: it ends where it met the surface, carried along, and moves into it no more. True if so.
bool stop_at(const ThinCollider& thin, const Vec3& x, Vec3& y, Vec3& v);

}  // namespace firn
