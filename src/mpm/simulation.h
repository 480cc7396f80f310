// SPDX-License-Identifier: MIT
// The simulation as the rest of firn sees it: made from a setup, advanced to exact times, read through
// snapshots. Inside (step.cpp): sort by block (when needed) -> P2G -> grid update -> G2P.
#pragma once
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "src/core/vector.h"
#include "src/geometry/keyframes.h"
#include "src/geometry/shape.h"
#include "src/mpm/material.h"
#include "src/particles/snapshot.h"

namespace firn::kernels {
struct KernelTable;
}

namespace firn {

enum class Contact { sticky, slip, separating };

struct Collider {
  std::string name;
  Shape shape;
  Contact contact = Contact::separating;
  double friction = 0.3;                  // Coulomb coefficient of what slides, for `separating` and `slip`
  std::optional<double> static_friction;  // of what stands, >= friction; empty: the same
  Motion motion;                          // of `shape`, by the simulation's time
};

// The particles of one snow object as they are placed, world space. One entry a particle in each column.
struct PlacedSnow {
  std::string name;
  Material material;
  std::vector<Vec3> position;  // m
  std::vector<Vec3> velocity;  // m/s (linear + spin)
  std::vector<float> packing;  // plastic volume ratio Jp at the start; empty: all 1
  double particle_volume = 0;  // m^3, unstrained; the mean where each has its own
  // m/s; the speed at which still air carries its weight, on each particle alike. Empty: no air.
  std::optional<double> terminal_velocity;

  std::vector<double> volume;           // m^3, of each particle; empty: all particle_volume
  std::vector<Eigen::Matrix3f> strain;  // elastic deformation gradient F at the start; empty: none

  double particle_mass() const { return particle_volume * material.density; }  // kg, the mean
  double volume_of(std::size_t i) const { return volume.empty() ? particle_volume : volume[i]; }  // m^3
};

struct SimulationSetup {
  double dx = 0.01;                  // m
  Vec3 gravity = Vec3(0, -9.81, 0);  // m/s^2
  std::optional<double> fixed_dt;    // s; empty: adaptive
  double max_dt = 1e-2;              // s
  std::vector<PlacedSnow> snow;      // index = Snapshot::object
  std::vector<Collider> colliders;
  // Optional domain box (any pose): particles that leave it leave the simulation and are counted.
  std::optional<Shape> domain;
  // Where the grid's origin and axes lie in the world; empty: they are the world's. Everything else here, and
  // all that the simulation tells, is in world coordinates.
  std::optional<Pose> frame;
  bool check_energy_bound = true;  // the |v| blow-up check
  bool sleep = true;               // leave out snow that has come to rest
};

// What limits dt now, for people: "elastic wave (packed snow, 145 m/s)", "particle speed 3.2 m/s", ...
struct TimeStep {
  double dt = 0;  // s
  std::string cause;
};

// What a collider does to the snow: N, the mean over the frame (from the last time that advance_to reached,
// or over the last step()). Snow that sleeps counts with the force that carries it.
struct ContactForce {
  std::string collider;
  Vec3 force = Vec3::Zero();
};

struct Metrics {
  double time = 0;
  std::uint64_t steps = 0;               // since the start of the run
  std::uint64_t particle_steps = 0;      // without those of particles asleep
  std::size_t particles = 0;             // still inside
  std::size_t particles_left = 0;        // gone through the domain's boundary
  std::size_t particles_asleep = 0;      // at rest and left out of the next step
  double mass = 0;                       // kg
  Vec3 momentum = Vec3::Zero();          // kg m/s
  Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s about the world origin, with the APIC affine part
  double kinetic_energy = 0;             // J
  double elastic_energy = 0;             // J
  double potential_energy = 0;           // J, -m g.x
  double plastic_work = 0;               // J since the start: what yielding took from the elastic energy
  double volume = 0;                     // m^3, sum of V0 * J
  // kg/m^3, the density below which lie 5, 50 and 95 % of the mass. That of a particle is m / (V0 det F Jp).
  double density_p05 = 0, density_p50 = 0, density_p95 = 0;
  double front = 0;                    // m, x . front_direction below which lies 99 % of the mass
  double max_speed = 0;                // m/s
  Bounds bounds;                       // of particle centres
  TimeStep step;                       // last step's dt and its cause
  std::vector<ContactForce> contacts;  // one a collider, in the scene's order
};

// The way that snow runs: down the steepest plane among the colliders, along it; +x where none is tilted.
Vec3 front_direction(const SimulationSetup& setup);

class Simulation {
 public:
  // Errors: usage Error when there are no particles, or a particle lies outside the addressable range.
  Simulation(const kernels::KernelTable& kernels, SimulationSetup setup);
  ~Simulation();
  Simulation(Simulation&&) noexcept;

  // Steps until `time` (s) is reached exactly. Returns false if a stop was requested first (the state is then
  // between two steps and may be saved). Throws an unstable Error that names step, particle and likely cause.
  bool advance_to(double time, const std::stop_token& stop = {});
  void step(double dt);  // one step; for tests and benches

  double time() const;
  TimeStep stable_step() const;  // the dt that the next step would take at most
  std::size_t particle_count() const;
  std::size_t resident_bytes() const;  // all memory of the simulation
  std::size_t grid_blocks() const;     // active 4x4x4 node blocks
  std::uint64_t particle_steps() const;
  Metrics metrics() const;
  std::uint64_t state_hash() const;  // of every particle column, in id order

  void snapshot(Snapshot& out) const;  // frame is left to the caller

  // The whole state, bit for bit: load(save(s)) continues as s would have.
  void save(std::ostream& out) const;
  void load(std::istream& in);  // io Error when it does not fit this setup

  struct State;  // src/mpm/state.h, for this room alone

 private:
  std::unique_ptr<State> state_;
};

}  // namespace firn
