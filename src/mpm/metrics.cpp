// SPDX-License-Identifier: MIT
// What is measured of the whole snow, and the state's hash. Sums are made in double, block by block in order.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/core/rng.h"
#include "src/mpm/colliders.h"
#include "src/mpm/measure.h"
#include "src/mpm/percentile.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// Of the particles of a block, then of all.
struct Sums {
  double mass = 0, kinetic_energy = 0, elastic_energy = 0, potential_energy = 0, volume = 0, max_speed = 0;
  Vec3 momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();
  Bounds bounds;
};

void add_particle(const Solver::State& s, const BlockCoord& block, std::size_t i, double energy_density,
                  Sums& sums) {
  const kernels::ParticleView p = s.particles.view();
  const double dx = s.setup.dx, mass = p.m[i];
  const Vec3 local(p.v[0][i], p.v[1][i], p.v[2][i]), x = point_in_world(s.setup.frame, position(s, block, i));
  const Vec3 v = vector_in_world(s.setup.frame, local);
  const Mat3 b = matrix_at(p.C, i) * (mass * dx * dx / 4);  // sum w m v_i (x_i - x_p)^T
  sums.mass += mass;
  sums.momentum += mass * v;
  const Vec3 affine(b(2, 1) - b(1, 2), b(0, 2) - b(2, 0), b(1, 0) - b(0, 1));
  sums.angular_momentum += mass * x.cross(v) + vector_in_world(s.setup.frame, affine);
  sums.kinetic_energy += 0.5 * mass * v.squaredNorm();
  sums.elastic_energy += volume_as_placed(s, i) * energy_density;
  sums.potential_energy -= mass * vector_in_world(s.setup.frame, s.setup.gravity).dot(x);
  sums.volume += volume_now(s, i);
  sums.max_speed = std::max(sums.max_speed, v.norm());
  sums.bounds.include(x);
}

void add_block(const Sums& block, Sums& all) {
  all.mass += block.mass;
  all.momentum += block.momentum;
  all.angular_momentum += block.angular_momentum;
  all.kinetic_energy += block.kinetic_energy;
  all.elastic_energy += block.elastic_energy;
  all.potential_energy += block.potential_energy;
  all.volume += block.volume;
  all.max_speed = std::max(all.max_speed, block.max_speed);
  all.bounds.include(block.bounds);
}

// What is told of the whole snow at once, particle by particle.
void add_percentiles(const Solver::State& s, Metrics& m) {
  const kernels::ParticleView p = s.particles.view();
  std::vector<float> density(s.particles.size()), run(s.particles.size());
  parallel_for(s.blocks.size(), 4, [&](std::size_t b) {
    for (std::size_t i = s.blocks.begin[b]; i < s.blocks.begin[b + 1]; ++i) {
      density[i] = static_cast<float>(p.m[i] / volume_now(s, i));
      const Vec3 x = point_in_world(s.setup.frame, position(s, s.blocks.coord[b], i));
      run[i] = static_cast<float>(s.front.dot(x));
    }
  });
  // Side by side: each is a sum over the particles in their order, too short to be worth cutting.
  const std::vector<float>* const value[] = {&density, &density, &density, &run};
  const double part[] = {0.05, 0.5, 0.95, 0.99};
  double* const to[] = {&m.density_p05, &m.density_p50, &m.density_p95, &m.front};
  parallel_for(4, 1, [&](std::size_t i) { *to[i] = mass_percentile(*value[i], p.m, part[i]); });
}

}  // namespace

Vec3 front_direction(const SolverSetup& setup) {
  const double g = setup.gravity.norm();
  Vec3 steepest = Vec3::Zero();
  for (const Collider& collider : setup.colliders) {
    if (!std::holds_alternative<HalfSpace>(collider.shape.form) || g == 0) continue;
    const Vec3 normal = collider.shape.pose.rotation.col(1), fall = setup.gravity / g;
    const Vec3 along = fall - normal * normal.dot(fall);  // its length is the sine of the tilt
    const bool floor = normal.dot(fall) < -0.01;          // not a wall or a ceiling
    if (floor && along.norm() > steepest.norm()) steepest = along;
  }
  return steepest.norm() > 1e-3 ? Vec3(steepest.normalized()) : Vec3(1, 0, 0);
}

Metrics Solver::metrics() const {
  const State& s = *state_;
  std::vector<Sums> of_block(s.blocks.size());
  parallel_for(s.blocks.size(), 4, [&](std::size_t b) {
    const std::size_t begin = s.blocks.begin[b], end = s.blocks.begin[b + 1];
    std::vector<float> energy(end - begin);
    s.kernels.mpm.elastic_energy(s.materials.data(), s.particles.view(), {begin, end}, energy.data());
    for (std::size_t i = begin; i < end; ++i)
      add_particle(s, s.blocks.coord[b], i, energy[i - begin], of_block[b]);
  });
  Sums sums;
  for (const Sums& block : of_block) add_block(block, sums);
  Metrics all;
  all.mass = sums.mass;
  all.momentum = array_of(sums.momentum);
  all.angular_momentum = array_of(sums.angular_momentum);
  all.kinetic_energy = sums.kinetic_energy;
  all.elastic_energy = sums.elastic_energy;
  all.potential_energy = sums.potential_energy;
  all.volume = sums.volume;
  all.max_speed = sums.max_speed;
  all.bounds_min = array_of(sums.bounds.min);
  all.bounds_max = array_of(sums.bounds.max);
  add_percentiles(s, all);
  all.time = s.time;
  all.steps = s.steps;
  all.particle_steps = s.particle_steps;
  all.particles = s.particles.size();
  all.particles_left = s.left;
  all.particles_asleep = s.asleep();
  all.step = s.last_step;
  all.plastic_work = s.plastic_work;
  for (std::size_t k = 0; k < s.setup.colliders.size(); ++k) {
    const Impulse mean = s.forces.mean(k, s.time);
    const Vec3 torque = mean.moment_about(pivot_of(s.setup.colliders[k], s.time));
    all.contacts.push_back({s.setup.colliders[k].name, array_of(vector_in_world(s.setup.frame, mean.linear)),
                            array_of(vector_in_world(s.setup.frame, torque))});
  }
  return all;
}

// A sum over particles of a hash of all their bits: the same for any order, so no sort by id is needed.
// Positions enter as whole-lattice integers, so neither does it matter when the particles were last sorted.
std::uint64_t Solver::state_hash() const {
  const State& s = *state_;
  std::vector<std::uint64_t> of_block(s.blocks.size());
  parallel_for(s.blocks.size(), 4, [&](std::size_t b) {
    const BlockCoord& c = s.blocks.coord[b];
    const std::int64_t corner[3] = {c.x, c.y, c.z};
    for (std::size_t i = s.blocks.begin[b]; i < s.blocks.begin[b + 1]; ++i) {
      std::uint64_t h = 0;
      for (std::size_t k = 0; k < kColumns; ++k) {
        const std::uint32_t bits = s.particles.column(k)[i];
        const std::int64_t place =
            k < 3 ? corner[k] * 4 * kernels::kOneCell + static_cast<std::int32_t>(bits) : bits;
        h = hash_keys(h, place);
      }
      of_block[b] += h;
    }
  });
  std::uint64_t all = 0;
  for (const std::uint64_t h : of_block) all += h;
  return all;
}

}  // namespace firn
