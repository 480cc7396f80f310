// SPDX-License-Identifier: MIT
#include "src/mpm/colliders.h"

namespace firn {

namespace {

// A collider farther from the block's centre than this (cells) is not looked at: the nodes reach 2.6 cells
// from it, and the distance to a height field is true to first order only.
constexpr double kNearCells = 2 * 2.6;

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

// Fills the 64 nodes; false when none of them touches the collider.
bool fill_contact(const Collider& collider, const BlockCoord& block, double dx, kernels::ContactNodes& out) {
  out.kind = contact_kind(collider.contact);
  out.friction = static_cast<float>(collider.friction);
  out.static_friction = static_cast<float>(collider.static_friction.value_or(collider.friction));
  out.moving = 0;
  bool touches = false;
  for (int n = 0; n < kernels::kBlockNodes; ++n) {
    const Vec3 node(n / 16 - 0.5, n / 4 % 4 - 0.5, n % 4 - 0.5);  // node n lies at n - 1/2 cells
    const SurfacePoint surface = closest_surface(collider.shape, world_in_block(block, node, dx));
    out.distance[n] = static_cast<float>(surface.distance / dx);
    for (int axis = 0; axis < 3; ++axis) out.normal[axis][n] = static_cast<float>(surface.normal[axis]);
    touches = touches || out.distance[n] < kernels::kTouchingCells;
  }
  return touches;
}

}  // namespace

std::vector<kernels::ContactNodes> contacts_of_block(const std::vector<Collider>& colliders,
                                                     const BlockCoord& block, double dx) {
  std::vector<kernels::ContactNodes> contacts;
  const Vec3 center = world_in_block(block, Vec3::Constant(1.0), dx);
  for (const Collider& collider : colliders) {
    if (signed_distance(collider.shape, center) > kNearCells * dx) continue;
    kernels::ContactNodes nodes;
    if (fill_contact(collider, block, dx, nodes)) contacts.push_back(nodes);
  }
  return contacts;
}

}  // namespace firn
