// SPDX-License-Identifier: MIT
#include "bench/naive.h"

#include "src/mpm/solver.h"

namespace firn::bench {

namespace {

constexpr int kSortEvery = 20;       // steps
constexpr int kMargin = 8;           // cells between snow and the grid's ends after a sort
constexpr float kTouching = 1e-5f;   // cells; a node this near to the floor lies on it
constexpr float kMassFloor = 1e-12;  // of a particle's mass; nodes below it carry rounding noise only

NaiveSnow snow_of(const Material& m) {
  const ElasticModuli moduli = elastic_moduli(m);
  return {static_cast<float>(moduli.mu),
          static_cast<float>(moduli.lambda),
          static_cast<float>(m.hardening),
          static_cast<float>(1 - m.critical_compression),
          static_cast<float>(1 + m.critical_stretch),
          static_cast<float>(m.jp_min),
          static_cast<float>(m.jp_max)};
}

}  // namespace

// The 3x3x3 nodes around a particle: node n lies at n - 1/2 cells.
struct NaiveSimulation::Stencil {
  std::size_t first;       // node
  float w[3][3], d[3][3];  // weight and distance (cells) of node i on an axis
};

NaiveSimulation::NaiveSimulation(const SolverSetup& setup, bool stop_early)
    : stop_early_(stop_early), dx_(static_cast<float>(setup.dx)) {
  const PlacedSnow& snow = setup.snow.front();
  snow_ = snow_of(snow.material);
  mass_ = static_cast<float>(snow.particle_mass());
  volume_ = static_cast<float>(snow.particle_volume);
  for (int axis = 0; axis < 3; ++axis) gravity_[axis] = static_cast<float>(setup.gravity[axis]);
  if (!setup.colliders.empty()) {
    floor_ = static_cast<float>(setup.colliders.front().shape.pose.translation.y() / setup.dx);
    friction_ = static_cast<float>(setup.colliders.front().friction);
  }
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    NaiveParticle p{{}, {}, {}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {}, 1, static_cast<std::uint32_t>(i)};
    for (int axis = 0; axis < 3; ++axis) {
      p.x[axis] = static_cast<float>(snow.position[i][axis] / setup.dx);
      p.v[axis] = static_cast<float>(snow.velocity[i][axis]);
    }
    if (!snow.packing.empty()) p.Jp = snow.packing[i];
    particles_.push_back(p);
  }
  sort();
}

void NaiveSimulation::step(float dt) {
  drift_ += max_speed_ * dt / dx_;
  if (++steps_since_sort_ == kSortEvery || drift_ > kMargin - 4) sort();
  particles_to_grid(dt);
  update_grid(dt);
  grid_to_particles(dt);
}

void NaiveSimulation::place_grid() {
  for (int axis = 0; axis < 3; ++axis) {
    float low = 1e30f, high = -1e30f;
    for (const NaiveParticle& p : particles_) {
      low = std::min(low, p.x[axis]);
      high = std::max(high, p.x[axis]);
    }
    low_[axis] = static_cast<int>(std::floor(low)) - kMargin;
    size_[axis] = static_cast<int>(std::floor(high)) + kMargin + 1 - low_[axis];
  }
  grid_.resize(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
}

std::size_t NaiveSimulation::cell_of(const NaiveParticle& p) const {
  std::size_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    cell =
        cell * size_[axis] + static_cast<std::size_t>(static_cast<int>(std::floor(p.x[axis])) - low_[axis]);
  }
  return cell;
}

// Counting sort by cell.
void NaiveSimulation::sort() {
  place_grid();
  cell_begin_.assign(grid_.size() + 1, 0);
  for (const NaiveParticle& p : particles_) ++cell_begin_[cell_of(p) + 1];
  for (std::size_t c = 0; c < grid_.size(); ++c) cell_begin_[c + 1] += cell_begin_[c];
  sorted_.resize(particles_.size());
  for (const NaiveParticle& p : particles_) sorted_[cell_begin_[cell_of(p)]++] = p;
  particles_.swap(sorted_);
  steps_since_sort_ = 0;
  drift_ = 0;
}

inline NaiveSimulation::Stencil NaiveSimulation::stencil_of(const NaiveParticle& p) const {
  Stencil s;
  s.first = cell_of(p);
  for (int axis = 0; axis < 3; ++axis) {
    const float f = p.x[axis] - std::floor(p.x[axis]);
    s.w[axis][0] = 0.5f * (1 - f) * (1 - f);
    s.w[axis][1] = 0.75f - (f - 0.5f) * (f - 0.5f);
    s.w[axis][2] = 0.5f * f * f;
    for (int i = 0; i < 3; ++i) s.d[axis][i] = static_cast<float>(i) - 0.5f - f;
  }
  return s;
}

void NaiveSimulation::particles_to_grid(float dt) {
  std::fill(grid_.begin(), grid_.end(), Node{});
  const float force = dt * volume_ * 4 / dx_;
  for (const NaiveParticle& p : particles_) {
    const Stencil s = stencil_of(p);
    float momentum[3], affine[9];  // affine: for distances in cells
    for (int k = 0; k < 3; ++k) momentum[k] = mass_ * p.v[k];
    for (int k = 0; k < 9; ++k) affine[k] = mass_ * dx_ * p.C[k] - force * p.tau[k];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        Node* row = &grid_[s.first + (static_cast<std::size_t>(i) * size_[1] + j) * size_[2]];
        for (int k = 0; k < 3; ++k) {
          const float w = s.w[0][i] * s.w[1][j] * s.w[2][k];
          for (int r = 0; r < 3; ++r) {
            row[k].v[r] += w * (momentum[r] + affine[3 * r] * s.d[0][i] + affine[3 * r + 1] * s.d[1][j] +
                                affine[3 * r + 2] * s.d[2][k]);
          }
          row[k].m += w * mass_;
        }
      }
    }
  }
}

// Stomakhin et al. 2013, section 8: v loses what goes into the floor, and as much of its rest as friction
// takes.
void NaiveSimulation::touch_floor(float v[3]) const {
  if (v[1] >= 0) return;
  const float speed = std::sqrt(v[0] * v[0] + v[2] * v[2]);
  const float kept = std::max(speed + friction_ * v[1], 0.f) / std::max(speed, 1e-30f);
  v[0] *= kept;
  v[1] = 0;
  v[2] *= kept;
}

void NaiveSimulation::update_grid(float dt) {
  Node* node = grid_.data();
  for (int i = 0; i < size_[0]; ++i) {
    for (int j = 0; j < size_[1]; ++j) {
      const bool touches = static_cast<float>(low_[1] + j) - 0.5f - floor_ < kTouching;
      for (int k = 0; k < size_[2]; ++k, ++node) {
        const bool carries = node->m > kMassFloor * mass_;
        for (int r = 0; r < 3; ++r) node->v[r] = carries ? node->v[r] / node->m + dt * gravity_[r] : 0;
        if (touches) touch_floor(node->v);
      }
    }
  }
}

// v and C of one particle.
inline void NaiveSimulation::gather(NaiveParticle& p) const {
  const Stencil s = stencil_of(p);
  float v[3] = {}, c[9] = {};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Node* row = &grid_[s.first + (static_cast<std::size_t>(i) * size_[1] + j) * size_[2]];
      for (int k = 0; k < 3; ++k) {
        const float w = s.w[0][i] * s.w[1][j] * s.w[2][k];
        for (int r = 0; r < 3; ++r) {
          const float wv = w * row[k].v[r];
          v[r] += wv;
          c[3 * r] += wv * s.d[0][i];
          c[3 * r + 1] += wv * s.d[1][j];
          c[3 * r + 2] += wv * s.d[2][k];
        }
      }
    }
  }
  for (int r = 0; r < 3; ++r) p.v[r] = v[r];
  for (int k = 0; k < 9; ++k) p.C[k] = 4 / dx_ * c[k];
}

void NaiveSimulation::grid_to_particles(float dt) {
  clamped_ = 0;
  float speed2 = 0;
  bool finite = true;
  for (NaiveParticle& p : particles_) {
    gather(p);
    float f[9];  // (I + dt C) F
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        f[3 * r + c] = p.F[3 * r + c] +
                       dt * (p.C[3 * r] * p.F[c] + p.C[3 * r + 1] * p.F[3 + c] + p.C[3 * r + 2] * p.F[6 + c]);
      }
    }
    clamped_ += naive_yield(snow_, stop_early_, f, p.Jp, p.tau);
    for (int k = 0; k < 9; ++k) p.F[k] = f[k];
    for (int axis = 0; axis < 3; ++axis) p.x[axis] += dt * p.v[axis] / dx_;
    const float v2 = p.v[0] * p.v[0] + p.v[1] * p.v[1] + p.v[2] * p.v[2];
    finite = finite && v2 < 1e30f;
    speed2 = std::max(speed2, v2);
  }
  max_speed_ = finite ? std::sqrt(speed2) : INFINITY;
}

}  // namespace firn::bench
