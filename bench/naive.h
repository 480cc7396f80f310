// SPDX-License-Identifier: MIT
// The baseline of the benchmark: the same MLS-MPM step as firn's (quadratic B-splines, APIC, Stomakhin snow,
// a floor with friction) as a plain scalar float program would have it: one thread, an array of particles in
// the order of their cells, a dense grid around them. tests/physics/test_baseline.cpp holds it to firn's
// production step.
#pragma once
#include <cstdint>
#include <vector>

#include "bench/naive_snow.h"

namespace firn {
struct SolverSetup;
}

namespace firn::bench {

struct NaiveParticle {
  float x[3];    // cells from the world's origin
  float v[3];    // m/s
  float C[9];    // 1/s
  float F[9];    // row-major
  float tau[9];  // Pa, Kirchhoff stress
  float Jp;
  std::uint32_t id;
};

class NaiveSimulation {
 public:
  // The first snow object and, of the colliders, a horizontal floor (a half space) if there is one.
  // `stop_early`: naive_svd() ends when it has converged instead of after five sweeps.
  NaiveSimulation(const SolverSetup& setup, bool stop_early);

  void step(float dt);

  const std::vector<NaiveParticle>& particles() const { return particles_; }
  std::size_t clamped() const { return clamped_; }  // in the last step
  float max_speed() const { return max_speed_; }    // m/s; infinite when a particle is not finite

 private:
  struct Node {
    float v[3];  // momentum, then velocity
    float m;     // kg
  };
  struct Stencil;

  void sort();
  void place_grid();
  std::size_t cell_of(const NaiveParticle& p) const;
  Stencil stencil_of(const NaiveParticle& p) const;
  void particles_to_grid(float dt);
  void update_grid(float dt);
  void touch_floor(float v[3]) const;
  void grid_to_particles(float dt);
  void gather(NaiveParticle& p) const;

  bool stop_early_;
  NaiveSnow snow_{};
  float dx_ = 0, mass_ = 0, volume_ = 0;  // m; kg and m^3 a particle
  float gravity_[3] = {};                 // m/s^2
  float floor_ = -1e30f, friction_ = 0;   // floor's height in cells, Coulomb coefficient

  std::vector<NaiveParticle> particles_, sorted_;
  std::vector<std::uint32_t> cell_begin_;
  std::vector<Node> grid_;  // z fastest
  int low_[3] = {};         // first cell of the grid
  int size_[3] = {};
  int steps_since_sort_ = 0;
  float drift_ = 0;  // cells, at most, since the sort
  float max_speed_ = 0;
  std::size_t clamped_ = 0;
};

}  // namespace firn::bench
