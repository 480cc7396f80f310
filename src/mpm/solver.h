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

#include "firn/driver.h"
#include "firn/metrics.h"
#include "firn/snapshot.h"
#include "src/core/vector.h"
#include "src/geometry/keyframes.h"
#include "src/geometry/shape.h"
#include "src/mpm/material.h"

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

struct SolverSetup {
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

inline Bounds bounds_of(const Metrics& metrics) {  // m, of particle centres
  return {vec(metrics.bounds_min), vec(metrics.bounds_max)};
}

// The way that snow runs: down the steepest plane among the colliders, along it; +x where none is tilted.
Vec3 front_direction(const SolverSetup& setup);

class Solver {
 public:
  // Errors: usage Error when there are no particles, or a particle lies outside the addressable range.
  Solver(const kernels::KernelTable& kernels, SolverSetup setup);
  ~Solver();
  Solver(Solver&&) noexcept;

  // Steps until `time` (s) is reached exactly. Returns false if a stop was requested first (the state is then
  // between two steps and may be saved). Throws an unstable Error that names step, particle and likely cause.
  bool advance_to(double time, const std::stop_token& stop = {});
  double stable_advance();  // one step of the longest stable length, which is returned (s); errors as above
  void step(double dt);     // one step; for tests and benches

  // The collider with this index moves as the driver says, from where it is. Errors: usage Error if it has a
  // motion of its own.
  void drive(std::size_t collider, ColliderDriver driver);
  std::vector<Collider> colliders_now() const;  // with their shapes where they are now, world space

  // One more snow object, now, with ids that go on from the last; or its material alone, where it has no
  // particles, for a state that is to be loaded. Errors: usage Error for a particle beyond the addressable
  // range, or for too many; then nothing has changed.
  void add(PlacedSnow snow);
  // Takes out the particles with these ids. Returns how many there were.
  std::size_t remove(const std::vector<std::uint32_t>& ids);

  double time() const;
  double reached() const;        // as time(), for any thread at any time
  TimeStep stable_step() const;  // the dt that the next step would take at most
  std::size_t particle_count() const;
  std::size_t resident_bytes() const;  // all memory of the simulation
  std::size_t grid_blocks() const;     // active 4x4x4 node blocks
  std::uint64_t particle_steps() const;
  Metrics metrics() const;
  std::uint64_t state_hash() const;  // of every particle column, in id order

  // A copy in the same memory where it is large enough; `frame` is left to the caller.
  void snapshot(Snapshot& out, const StateColumns& columns = {}) const;

  // The whole state, bit for bit: load(save(s)) continues as s would have.
  void save(std::ostream& out) const;
  void load(std::istream& in);  // io Error when it does not fit this setup

  struct State;  // src/mpm/state.h, for this room alone

 private:
  std::unique_ptr<State> state_;
};

}  // namespace firn
