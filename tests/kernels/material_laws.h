// SPDX-License-Identifier: MIT
// What is asked of every material alike: its kernel yields as the reference does, and the reference's stress
// and wave speed follow from its energy and stress.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/catch.h"
#include "tests/kernels/particles.h"

namespace firn::test {

// Elements 5, 6 and 7 become of rank 0, 1 and 2.
inline void make_degenerate(const ParticleColumns& columns) {
  for (int k = 0; k < 9; ++k) {
    columns.view().F[k][5] = 0;
    columns.view().F[k][6] = k < 3 ? 1.f : 0.f;
    columns.view().F[k][7] = k == 0 || k == 4 ? 1.f : 0.f;
  }
}

// On every instruction set. noise(s): by how much round-off in F grows in the result, of its singular values
// s.
template <class Noise>
void check_yield_is_the_references(const std::vector<kernels::MaterialParams>& materials,
                                   const ParticleColumns& original, Noise&& noise) {
  make_degenerate(original);
  auto particles = reference_particles(original);
  for (auto& p : particles) kernels::reference::project(materials[p.object], p.F, p.Jp);
  on_every_isa([&](const kernels::KernelTable& table) {
    INFO(table.isa);
    const ParticleColumns columns = copy_of(original);
    table.mpm.project(materials.data(), columns.view(), {0, columns.size()});
    const kernels::ParticleView p = columns.view();
    Worst f_error, jp_error;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      double s[3], u[9], v[9], before[9];
      for (int k = 0; k < 9; ++k) before[k] = original.view().F[k][i];
      kernels::reference::svd(before, u, s, v);
      for (int k = 0; k < 9; ++k) CHECK(std::isfinite(p.F[k][i]));
      jp_error.add(std::fabs(p.Jp[i] - particles[i].Jp) / std::fabs(particles[i].Jp) *
                   std::min(1.0, std::fabs(s[2])));
      // Where two singular values meet with opposite signs, or vanish together, U is not unique: F may
      // differ.
      if (s[1] + s[2] <= 0.05 * s[0]) continue;
      for (int k = 0; k < 9; ++k) f_error.add(std::fabs(p.F[k][i] - particles[i].F[k]) / noise(s));
    }
    CHECK(f_error.value() < 3e-5);
    CHECK(jp_error.value() < 1e-5);
  });
}

// d psi = tau : (dF F^-1), at Jp = 1.
inline void check_stress_is_the_derivative_of_energy(const kernels::MaterialParams& m,
                                                     const ParticleColumns& columns) {
  Worst error;
  for (const auto& p : reference_particles(columns)) {
    double tau[9];
    kernels::reference::stress(m, p.F, 1, tau);
    for (int k = 0; k < 9; ++k) {
      double energy[2] = {};
      for (const int side : {0, 1}) {
        double f[9];
        std::copy(p.F, p.F + 9, f);
        for (int c = 0; c < 3; ++c) f[3 * (k / 3) + c] += (side ? 1e-6 : -1e-6) * p.F[3 * (k % 3) + c];
        energy[side] = kernels::reference::energy(m, f, 1);
      }
      error.add(std::fabs((energy[1] - energy[0]) / 2e-6 - tau[k]) / (2 * m.mu + m.lambda));
    }
  }
  CHECK(error.value() < 1e-7);
}

// Of uniaxial waves at Jp = 1.
inline void check_no_wave_is_faster_than_its_bound(const kernels::MaterialParams& m) {
  for (const double s : {0.3, 0.5, 0.8, 0.95, 1.0, 1.2, 2.0}) {
    const auto piola_at = [&](double stretch) {  // first Piola-Kirchhoff
      const double f[9] = {stretch, 0, 0, 0, 1, 0, 0, 0, 1};
      double tau[9];
      kernels::reference::stress(m, f, 1, tau);
      return tau[0] / stretch;
    };
    const double slope = (piola_at(s + 1e-6) - piola_at(s - 1e-6)) / 2e-6;
    const double f[9] = {s, 0, 0, 0, 1, 0, 0, 0, 1};
    INFO(s);
    CHECK(s * s * slope * m.inverse_density <= kernels::reference::wave_speed2(m, f, 1) * (1 + 1e-6));
  }
}

}  // namespace firn::test
