// SPDX-License-Identifier: MIT
// Seeded random particles for the kernel tests, as columns and as the reference's particles.
#pragma once
#include <cmath>
#include <cstring>
#include <vector>

#include "kernels/reference/mpm.h"
#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/particles/columns.h"

namespace firn::test {

// Numbers in [low, high), each a function of the seed and of how many came before.
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}
  double in(double low, double high) {
    return low + (high - low) * uniform_double(hash_keys(seed_, ++count_));
  }

 private:
  std::uint64_t seed_, count_ = 0;
};

template <class Material>
kernels::MaterialParams params_of(kernels::SharedParams shared) {
  kernels::MaterialParams params{};
  shared.kind = kernels::kKindOf<Material>;
  static_cast<kernels::SharedParams&>(params) = shared;
  return params;
}

inline std::vector<kernels::MaterialParams> test_materials() {
  using kernels::NeoHookean, kernels::Snow;
  return {params_of<Snow>({{}, 1, 58333.f, 38889.f, 1.f / 400, 0.975f, 1.0075f, 10.f, 0.6f, 20.f}),
          params_of<NeoHookean>({{}, 1, 30000.f, 50000.f, 1.f / 300, 0.95f, 1.05f, 0.f, 0.6f, 20.f}),
          params_of<Snow>({{}, 0, 58333.f, 38889.f, 1.f / 400, 0.975f, 1.0075f, 10.f, 0.6f, 20.f})};
}

inline kernels::StepParams test_step() {
  return {2e-4f, 0.01f, 100.f, {1e-4f, -2e-3f, 5e-4f}, 1e-18f, 0x1p60};
}

// A random rotation, by the quaternion of four random numbers.
inline void random_rotation(Random& random, double r[9]) {
  double q[4], norm = 0;
  for (double& c : q) {
    c = random.in(-1, 1);
    norm += c * c;
  }
  for (double& c : q) c /= std::sqrt(norm);
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                       2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                       2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  for (int k = 0; k < 9; ++k) r[k] = m[k];
}

// Particles anywhere in the block's margin; `strain` is how far F is from a rotation, `objects` how many are
// mixed.
inline ParticleColumns random_particles(std::size_t count, std::uint64_t seed, double strain,
                                        std::uint32_t objects) {
  ParticleColumns columns;
  columns.allocate(count);
  const kernels::ParticleView p = columns.view();
  Random random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    double rotation[9];
    random_rotation(random, rotation);
    for (int axis = 0; axis < 3; ++axis) {
      p.x[axis][i] = static_cast<std::int32_t>(random.in(-1, 4.999) * kernels::kOneCell);
      p.v[axis][i] = static_cast<float>(random.in(-3, 3));
    }
    for (int k = 0; k < 9; ++k) {
      p.C[k][i] = static_cast<float>(random.in(-40, 40));
      p.F[k][i] = static_cast<float>(rotation[k] + random.in(-strain, strain));
    }
    p.Jp[i] = static_cast<float>(random.in(0.8, 1.1));
    p.m[i] = static_cast<float>(random.in(4e-5, 6e-5));
    p.id[i] = static_cast<std::uint32_t>(i);
    p.object[i] = static_cast<std::uint32_t>(random.in(0, objects));
  }
  return columns;
}

inline ParticleColumns copy_of(const ParticleColumns& from) {
  ParticleColumns to;
  to.allocate(from.size());
  for (std::size_t k = 0; k < kColumns; ++k) {
    std::memcpy(to.column(k), from.column(k), from.size() * sizeof(float));
  }
  return to;
}

inline std::vector<kernels::reference::Particle> reference_particles(const ParticleColumns& columns) {
  const kernels::ParticleView p = columns.view();
  std::vector<kernels::reference::Particle> out(columns.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      out[i].x[axis] = static_cast<double>(p.x[axis][i]) / kernels::kOneCell;
      out[i].v[axis] = p.v[axis][i];
    }
    for (int k = 0; k < 9; ++k) {
      out[i].C[k] = p.C[k][i];
      out[i].F[k] = p.F[k][i];
    }
    out[i].Jp = p.Jp[i];
    out[i].m = p.m[i];
    out[i].object = static_cast<int>(p.object[i]);
  }
  return out;
}

// Runs f(table) on every instruction set of this machine.
template <class F>
void on_every_isa(F&& f) {
  for (const kernels::KernelTable* table : supported_kernels()) f(*table);
}

// The largest of a list of errors, failing for NaN.
class Worst {
 public:
  void add(double error) { worst_ = error <= worst_ ? worst_ : error; }
  double value() const { return worst_; }

 private:
  double worst_ = 0;
};

}  // namespace firn::test
