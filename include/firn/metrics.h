// SPDX-License-Identifier: MIT
// What a simulation measures of its snow as a whole: a row of metrics.csv.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "firn/vector.h"

namespace firn {

// What limits the time step now, for people: "elastic wave (packed snow, 145 m/s)", "particle speed (3.2
// m/s)", ...
struct TimeStep {
  double dt = 0;      // s
  std::string cause;  // empty before the first step
};

// What a collider does to the snow, which is what the snow does to it with the other sign: the ground, whose
// name is "ground", pushes snow at rest upwards with its weight. The mean over the last advance_to() or
// step(), an advance_to() that was stopped and the one that goes on with it being one; 0 before the first.
// Snow that sleeps counts with the force that carries it.
struct ContactForce {
  std::string collider;  // its name
  Vector3 force{};       // N
  Vector3 torque{};      // N m, about where the collider's pivot is now
};

// Sums over the particles that are still inside. World axes.
struct Metrics {
  double time = 0;                   // s
  std::uint64_t steps = 0;           // since the start of the run
  std::uint64_t particle_steps = 0;  // without those of particles asleep
  std::size_t particles = 0;         // still inside
  std::size_t particles_left = 0;    // gone through the domain's boundary
  std::size_t particles_asleep = 0;  // at rest and left out of the next step
  double mass = 0;                   // kg
  Vector3 momentum{};                // kg m/s
  Vector3 angular_momentum{};        // kg m^2/s about the world origin, with the APIC affine part
  double kinetic_energy = 0;         // J
  double elastic_energy = 0;         // J
  double potential_energy = 0;       // J, -m g.x
  double plastic_work = 0;           // J since the start: what yielding took from the elastic energy
  double volume = 0;                 // m^3, sum of V0 * J
  // kg/m^3, the density below which lie 5, 50 and 95 % of the mass. That of a particle is m / (V0 J).
  double density_p05 = 0;
  double density_p50 = 0;
  double density_p95 = 0;

  double front = 0;      // m along the way that snow runs, below which lies 99 % of the mass
  double max_speed = 0;  // m/s
  Vector3 bounds_min = {1e300, 1e300, 1e300};     // m, of particle centres; min > max: there are none
  Vector3 bounds_max = {-1e300, -1e300, -1e300};  // m
  TimeStep step;                                  // last step's dt and its cause
  std::vector<ContactForce> contacts;             // one a collider, in the scene's order, the ground first
};

}  // namespace firn
