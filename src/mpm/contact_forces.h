// SPDX-License-Identifier: MIT
// What the colliders do to the snow: the momentum that their contact gives to the grid nodes, in double and
// in a fixed order, over an interval of time (a frame).
//
// Snow that sleeps is left out of the steps, but a collider carries it all the same. How much follows from
// the stress that it sleeps with: P2G and the grid update of its nodes, once, from rest. What contact takes
// is proportional to the velocities, so a force found with one dt holds for any. Nodes that awake snow
// reaches are counted in the steps, the other ones here: each node once, and nothing has to be kept in a
// checkpoint.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "src/core/vector.h"

namespace firn {

// One entry a collider, in the scene's order.
struct ContactForces {
  std::vector<Vec3> impulse;      // N s, on the snow since the interval began
  std::vector<Vec3> on_sleepers;  // N, while they sleep
  double since = 0;               // s, when the interval began
  bool complete = true;           // the next step begins another one

  explicit ContactForces(std::size_t colliders)
      : impulse(colliders, Vec3::Zero()), on_sleepers(colliders, Vec3::Zero()) {}

  void begin_if_complete(double time) {
    if (!std::exchange(complete, false)) return;
    impulse.assign(impulse.size(), Vec3::Zero());
    since = time;
  }
  void add_sleepers(double dt) {
    for (std::size_t k = 0; k < impulse.size(); ++k) impulse[k] += dt * on_sleepers[k];
  }
  // N, over the interval up to `time`; 0 before the first step.
  Vec3 mean(std::size_t collider, double time) const {
    return time > since ? Vec3(impulse[collider] / (time - since)) : Vec3::Zero();
  }
};

// Of one grid block: its nodes that only sleeping snow reaches, and what colliders do to them.
struct SleepingNodes {
  struct Force {
    std::uint32_t collider;
    Vec3 force;  // N
  };
  std::uint64_t nodes = 0;  // bit n: node n
  std::vector<Force> forces;
};

}  // namespace firn
