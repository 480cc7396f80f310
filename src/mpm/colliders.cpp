// SPDX-License-Identifier: MIT
#include "src/mpm/colliders.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace firn {

namespace {

// A collider farther from the block's centre than this (cells) is not looked at: the nodes reach 2.6 cells
// from it, and the distance to a height field is true to first order only.
constexpr double kNearCells = 2 * 2.6;

// The nodes that a block's particles touch reach 6.1 cells from its centre; the rest is what a collider may
// move in a step.
constexpr double kTileCells = 6.5;

kernels::ContactKind contact_kind(Contact contact) {
  switch (contact) {
    case Contact::sticky:
      return kernels::kSticky;
    case Contact::slip:
      return kernels::kSlip;
    case Contact::separating:
      break;
  }
  return kernels::kSeparating;
}

// World position of a node of the block, given as n / 16, n / 4 % 4, n % 4: node n lies at n - 1/2 cells.
Vec3 node_position(const BlockCoord& block, int n, double dx) {
  return world_in_block(block, Vec3(n / 16 - 0.5, n / 4 % 4 - 0.5, n % 4 - 0.5), dx);
}

// Fills the 64 nodes; false when none of them touches the collider.
bool fill_contact(const Collider& collider, const Shape& shape, const BlockCoord& block, double dx,
                  kernels::ContactNodes& out) {
  out.kind = contact_kind(collider.contact);
  out.friction = static_cast<float>(collider.friction);
  out.static_friction = static_cast<float>(collider.static_friction.value_or(collider.friction));
  out.moving = 0;
  bool touches = false;
  for (int n = 0; n < kernels::kBlockNodes; ++n) {
    const SurfaceDistance surface = closest_surface(shape, node_position(block, n, dx));
    out.distance[n] = static_cast<float>(surface.distance / dx);
    for (int axis = 0; axis < 3; ++axis) out.normal[axis][n] = static_cast<float>(surface.normal[axis]);
    touches = touches || out.distance[n] < kernels::kTouchingCells;
  }
  return touches;
}

void set_velocity(const RigidVelocity& velocity, const BlockCoord& block, double dx,
                  kernels::ContactNodes& out) {
  if (velocity.is_zero()) return;
  out.moving = 1;
  const Vec3 first = velocity.at(node_position(block, 0, dx));
  for (int axis = 0; axis < 3; ++axis) {
    out.velocity[axis] = static_cast<float>(first[axis]);
    out.turn[axis] = static_cast<float>(velocity.angular[axis] * dx);
  }
}

// m; how far from the pivot the collider can touch snow: not beyond its own end, nor the snow's.
double lever_to(const Collider& collider, const Bounds& snow) {
  if (snow.empty()) return 0;
  const Vec3 pivot = collider.motion.pivot(0);
  const double way = collider.motion.longest_way(0, 1e300, 0);  // of the pivot from there
  const double far = (snow.max - pivot).cwiseAbs().cwiseMax((snow.min - pivot).cwiseAbs()).norm() + way;
  return std::min(collider.motion.lever(collider.shape), far);
}

double distance_to(const Bounds& bounds, const Vec3& x) {
  return (bounds.min - x).cwiseMax(x - bounds.max).cwiseMax(0.0).norm();
}

}  // namespace

Vec3 pivot_of(const Collider& collider, double time) {
  return collider.motion.empty() ? collider.shape.pose.translation : collider.motion.pivot(time);
}

Impulse take_impulse(double* sums, const BlockCoord& block, double dx) {
  const Vec3 linear(sums[0], sums[1], sums[2]), moment(sums[3], sums[4], sums[5]);
  std::fill_n(sums, kernels::kImpulseParts, 0.0);
  return {linear, node_position(block, 0, dx).cross(linear) + dx * moment};
}

std::vector<kernels::ContactNodes> contacts_of_block(const std::vector<Collider>& colliders,
                                                     const BlockCoord& block, double dx) {
  std::vector<kernels::ContactNodes> contacts;
  const Vec3 center = world_in_block(block, Vec3::Constant(1.0), dx);
  for (const Collider& collider : colliders) {
    if (!collider.motion.empty() || signed_distance(collider.shape, center) > kNearCells * dx) continue;
    kernels::ContactNodes nodes;
    nodes.collider = static_cast<std::int32_t>(&collider - colliders.data());
    if (fill_contact(collider, collider.shape, block, dx, nodes)) contacts.push_back(nodes);
  }
  return contacts;
}

std::vector<MovingCollider> moving_colliders(const std::vector<Collider>& colliders, double begin,
                                             double end) {
  std::vector<MovingCollider> moving;
  for (const Collider& collider : colliders) {
    if (collider.motion.empty()) continue;
    const Shape shape{collider.shape.form, collider.motion.pose(collider.shape.pose, end)};
    moving.push_back({&collider, static_cast<std::int32_t>(&collider - colliders.data()), shape,
                      world_bounds(shape), collider.motion.velocity(begin, end)});
  }
  return moving;
}

std::vector<kernels::ContactNodes> contacts_of_block(const std::vector<MovingCollider>& moving,
                                                     const BlockCoord& block, double dx) {
  std::vector<kernels::ContactNodes> contacts;
  const Vec3 center = world_in_block(block, Vec3::Constant(1.0), dx);
  for (const MovingCollider& m : moving) {
    if (distance_to(m.bounds, center) > kNearCells * dx) continue;
    if (signed_distance(m.shape, center) > kNearCells * dx) continue;
    kernels::ContactNodes nodes;
    nodes.collider = m.index;
    if (!fill_contact(*m.collider, m.shape, block, dx, nodes)) continue;
    set_velocity(m.velocity, block, dx, nodes);
    contacts.push_back(nodes);
  }
  return contacts;
}

bool touched_by(const MovingCollider& moving, const BlockCoord& block, double dx) {
  const Vec3 center = world_in_block(block, Vec3::Constant(2.0), dx);
  const bool rough = std::holds_alternative<HeightField>(moving.shape.form);
  const double reach = (rough ? 2 : 1) * kTileCells * dx;
  return distance_to(moving.bounds, center) <= reach && signed_distance(moving.shape, center) <= reach;
}

double speed_where_snow_is(const Collider& collider, const Bounds& snow, double begin, double end) {
  return collider.motion.top_speed(begin, end, lever_to(collider, snow));
}

double way_where_snow_is(const Collider& collider, const Bounds& snow, double begin, double end) {
  return collider.motion.longest_way(begin, end, lever_to(collider, snow));
}

}  // namespace firn
