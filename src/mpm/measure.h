// SPDX-License-Identifier: MIT
// What one particle is, in double, from its columns. Everything is in the simulation's frame.
#pragma once
#include <Eigen/LU>
#include <cmath>

#include "src/mpm/state.h"

namespace firn {

inline Mat3 matrix_at(float* const (&columns)[9], std::size_t i) {
  Mat3 m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = columns[k][i];
  return m;
}

// m, in the simulation's frame.
inline Vec3 position(const Solver::State& s, const BlockCoord& block, std::size_t i) {
  const kernels::ParticleView p = s.particles.view();
  return world_in_block(block, Vec3(p.x[0][i], p.x[1][i], p.x[2][i]) / kernels::kOneCell, s.setup.dx);
}

inline double volume_as_placed(const Solver::State& s, std::size_t i) {
  const kernels::ParticleView p = s.particles.view();
  return p.m[i] / s.setup.snow[p.object[i]].material.density;
}
inline double volume_now(const Solver::State& s, std::size_t i) {
  const kernels::ParticleView p = s.particles.view();
  return volume_as_placed(s, i) * matrix_at(p.F, i).determinant() * std::abs(p.Jp[i]);
}

}  // namespace firn
