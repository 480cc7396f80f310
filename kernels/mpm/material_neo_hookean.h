// SPDX-License-Identifier: MIT
// Neo-Hookean elasticity: tau = mu (F F^T - I) + lambda ln(J) I, psi = mu/2 (|F|^2 - 3) - mu ln J + lambda/2
// ln^2 J.
#pragma once
#include "kernels/mpm/clamp.h"
#include "kernels/mpm/views.h"
#include "kernels/simd/mat3.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {

struct NeoHookean {
  // The logarithm ends at J = 0.01: an element that is flatter, or inside out, keeps the greatest finite
  // pressure.
  static FIRN_INLINE Floats log_volume(const Deformation& d) { return log(max(d.j, splat(0.01f))); }

  static FIRN_INLINE Sym3 stress(const MaterialParams& p, float scale, const Deformation& d, Floats) {
    return add_diagonal(d.e * splat(p.mu * scale), splat(p.lambda * scale) * log_volume(d));
  }

  static FIRN_INLINE Floats energy(const MaterialParams& p, const Deformation& d, Floats) {
    const Floats log_j = log_volume(d);
    return splat(0.5f * p.mu) * trace(d.e) + log_j * (splat(0.5f * p.lambda) * log_j - splat(p.mu));
  }

  // Spatial speed of a uniaxial wave, F^2 dP/dF / rho0 = (mu (F^2 + 1) + lambda (1 - ln F)) / rho0, with the
  // largest squared stretch bounded by |F|^2 - 2.
  static FIRN_INLINE Floats wave_speed2(const MaterialParams& p, const Deformation& d, Floats) {
    const Floats one = splat(1.f);
    const Floats stretch2 = max(one, trace(d.e) + one);
    const Floats bulk = splat(p.lambda) * (one + max(splat(0.f), -log_volume(d)));
    return (splat(p.mu) * (one + stretch2) + bulk) * splat(p.inverse_density);
  }

  static FIRN_INLINE Mask yields(const MaterialParams& p, const Deformation& d, Floats) {
    return !inside_box(d, p.sigma_min, p.sigma_max);
  }

  // The clamp of the source paper; Jp is kept for the density only.
  static FIRN_INLINE Mask project(const MaterialParams& p, Mat3& f, Floats& jp, Mask active) {
    return clamp_into_jp(p, f, jp, active);
  }
};

}  // namespace firn::kernels::FIRN_ISA
