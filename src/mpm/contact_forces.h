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
#include <vector>

#include "src/core/vector.h"

namespace firn {

// An impulse on the snow and its moment about the origin of the simulation's frame; a second of it: force and
// torque.
struct Impulse {
  Vec3 linear = Vec3::Zero();   // N s
  Vec3 angular = Vec3::Zero();  // N m s

  static Impulse at(const Vec3& place, const Vec3& linear) { return {linear, place.cross(linear)}; }
  Vec3 moment_about(const Vec3& place) const { return angular - place.cross(linear); }
  bool is_zero() const { return linear.isZero(0) && angular.isZero(0); }
  Impulse& operator+=(const Impulse& other) {
    linear += other.linear;
    angular += other.angular;
    return *this;
  }
  friend Impulse operator*(double scale, const Impulse& i) { return {scale * i.linear, scale * i.angular}; }
  friend Impulse operator-(const Impulse& a, const Impulse& b) {
    return {a.linear - b.linear, a.angular - b.angular};
  }
};

// One entry a collider, in the scene's order.
struct ContactForces {
  std::vector<Impulse> impulse;      // on the snow since the interval began
  std::vector<Impulse> on_sleepers;  // a second, while they sleep
  double since = 0;                  // s, when the interval began
  bool complete = true;              // the next step begins another one

  explicit ContactForces(std::size_t colliders) : impulse(colliders), on_sleepers(colliders) {}

  void begin_if_complete(double time) {
    if (complete) begin(time);
  }
  void begin(double time) {
    complete = false;
    impulse.assign(impulse.size(), {});
    since = time;
  }
  void add_sleepers(double dt) {
    for (std::size_t k = 0; k < impulse.size(); ++k) impulse[k] += dt * on_sleepers[k];
  }
  // A second of it, over the interval up to `time`; 0 before the first step.
  Impulse mean(std::size_t collider, double time) const {
    if (time <= since) return {};
    return {impulse[collider].linear / (time - since), impulse[collider].angular / (time - since)};
  }
};

// Of one grid block: its nodes that only sleeping snow reaches, and what colliders do to them.
struct SleepingNodes {
  struct Force {
    std::uint32_t collider;
    Impulse force;  // a second of it
  };
  std::uint64_t nodes = 0;  // bit n: node n
  std::vector<Force> forces;
};

}  // namespace firn
