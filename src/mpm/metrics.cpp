// SPDX-License-Identifier: MIT
// What leaves the simulation: metrics, snapshots and the state's hash. Sums are made in double, block by
// block in order.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/core/rng.h"
#include "src/core/rotation.h"
#include "src/mpm/colliders.h"
#include "src/mpm/percentile.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

Mat3 matrix_at(float* const (&columns)[9], std::size_t i) {
  Mat3 m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = columns[k][i];
  return m;
}

// m, in the simulation's frame.
Vec3 position(const Simulation::State& s, const BlockCoord& block, std::size_t i) {
  const kernels::ParticleView p = s.particles.view();
  return world_in_block(block, Vec3(p.x[0][i], p.x[1][i], p.x[2][i]) / kernels::kOneCell, s.setup.dx);
}

double volume_as_placed(const Simulation::State& s, std::size_t i) {
  const kernels::ParticleView p = s.particles.view();
  return p.m[i] / s.setup.snow[p.object[i]].material.density;
}
double volume_now(const Simulation::State& s, std::size_t i) {
  const kernels::ParticleView p = s.particles.view();
  return volume_as_placed(s, i) * matrix_at(p.F, i).determinant() * std::abs(p.Jp[i]);
}

void add_particle(const Simulation::State& s, const BlockCoord& block, std::size_t i, double energy_density,
                  Metrics& m) {
  const kernels::ParticleView p = s.particles.view();
  const double dx = s.setup.dx, mass = p.m[i];
  const Vec3 local(p.v[0][i], p.v[1][i], p.v[2][i]), x = point_in_world(s.setup.frame, position(s, block, i));
  const Vec3 v = vector_in_world(s.setup.frame, local);
  const Mat3 b = matrix_at(p.C, i) * (mass * dx * dx / 4);  // sum w m v_i (x_i - x_p)^T
  m.mass += mass;
  m.momentum += mass * v;
  const Vec3 affine(b(2, 1) - b(1, 2), b(0, 2) - b(2, 0), b(1, 0) - b(0, 1));
  m.angular_momentum += mass * x.cross(v) + vector_in_world(s.setup.frame, affine);
  m.kinetic_energy += 0.5 * mass * v.squaredNorm();
  m.elastic_energy += volume_as_placed(s, i) * energy_density;
  m.potential_energy -= mass * vector_in_world(s.setup.frame, s.setup.gravity).dot(x);
  m.volume += volume_now(s, i);
  m.max_speed = std::max(m.max_speed, v.norm());
  m.bounds.include(x);
}

void add_block(const Metrics& block, Metrics& all) {
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

// How far the particle has turned, in world axes. F is the elastic part: yielding keeps its rotation, and
// where strains are small F takes up the whole spin of the snow.
PackedRotation turn_in_world(const Simulation::State& s, std::size_t i) {
  Mat3 rotation = polar_rotation(matrix_at(s.particles.view().F, i));
  if (const auto& frame = s.setup.frame) rotation = frame->rotation * rotation * frame->rotation.transpose();
  return pack_rotation(rotation);
}

// The block in the middle of the snow: positions of a snapshot count from its corner.
BlockCoord middle_block(const std::vector<BlockCoord>& blocks) {
  if (blocks.empty()) return {0, 0, 0};
  BlockCoord low = blocks.front(), high = low;
  for (const BlockCoord& b : blocks) {
    low = {std::min(low.x, b.x), std::min(low.y, b.y), std::min(low.z, b.z)};
    high = {std::max(high.x, b.x), std::max(high.y, b.y), std::max(high.z, b.z)};
  }
  return {(low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2};
}

// What is told of the whole snow at once, particle by particle.
void add_percentiles(const Simulation::State& s, Metrics& m) {
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

Vec3 front_direction(const SimulationSetup& setup) {
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

Metrics Simulation::metrics() const {
  const State& s = *state_;
  std::vector<Metrics> of_block(s.blocks.size());
  parallel_for(s.blocks.size(), 4, [&](std::size_t b) {
    const std::size_t begin = s.blocks.begin[b], end = s.blocks.begin[b + 1];
    std::vector<float> energy(end - begin);
    s.kernels.mpm.elastic_energy(s.materials.data(), s.particles.view(), {begin, end}, energy.data());
    for (std::size_t i = begin; i < end; ++i)
      add_particle(s, s.blocks.coord[b], i, energy[i - begin], of_block[b]);
  });
  Metrics all;
  for (const Metrics& block : of_block) add_block(block, all);
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
    all.contacts.push_back(
        {s.setup.colliders[k].name, vector_in_world(s.setup.frame, s.forces.mean(k, s.time))});
  }
  return all;
}

void Simulation::snapshot(Snapshot& out) const {
  const State& s = *state_;
  const kernels::ParticleView p = s.particles.view();
  const BlockCoord origin = middle_block(s.blocks.coord);
  out.time = s.time;
  out.dx = s.setup.dx;
  out.origin = point_in_world(s.setup.frame, world_in_block(origin, Vec3::Zero(), s.setup.dx));
  out.resize(s.particles.size());
  parallel_for(s.blocks.size(), 4, [&](std::size_t b) {
    const BlockCoord& c = s.blocks.coord[b];
    const BlockCoord relative{c.x - origin.x, c.y - origin.y, c.z - origin.z};
    for (std::size_t i = s.blocks.begin[b]; i < s.blocks.begin[b + 1]; ++i) {
      const Vec3 x = vector_in_world(s.setup.frame, position(s, relative, i));
      const Vec3 v = vector_in_world(s.setup.frame, Vec3(p.v[0][i], p.v[1][i], p.v[2][i]));
      for (int axis = 0; axis < 3; ++axis) {
        out.x[axis][i] = static_cast<float>(x[axis]);
        out.v[axis][i] = static_cast<float>(v[axis]);
      }
      out.density[i] = static_cast<float>(p.m[i] / volume_now(s, i));
      out.volume0[i] = static_cast<float>(volume_as_placed(s, i));
      const PackedRotation turn = turn_in_world(s, i);
      for (int axis = 0; axis < 3; ++axis) out.turn[axis][i] = turn[axis];
      out.id[i] = p.id[i];
      out.object[i] = static_cast<std::uint16_t>(p.object[i]);
    }
  });
}

// A sum over particles of a hash of all their bits: the same for any order, so no sort by id is needed.
// Positions enter as whole-lattice integers, so neither does it matter when the particles were last sorted.
std::uint64_t Simulation::state_hash() const {
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
