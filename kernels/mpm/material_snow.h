// SPDX-License-Identifier: MIT
// Snow after Stomakhin et al. 2013, sections 5 and 6: fixed corotated, tau = 2 mu (F - R) F^T + lambda (J -
// 1) J I, with mu and lambda scaled by exp(xi (1 - Jp)). With E = F F^T - I and G = sqrt(F F^T) - I the first
// term is 2 mu (G + G^2) = 2 mu (E - G).
#pragma once
#include "kernels/mpm/clamp.h"
#include "kernels/mpm/stretch.h"
#include "kernels/mpm/views.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {

struct Snow {
  static FIRN_INLINE Floats hardening(const MaterialParams& p, Floats jp) {
    return exp(splat(p.hardening) * (splat(1.f) - jp));
  }

  static FIRN_INLINE Sym3 stress(const MaterialParams& p, float scale, const Deformation& d, Floats jp) {
    const Floats h = hardening(p, jp);
    return corotated_stress(d, splat(2.f * p.mu * scale) * h,
                            (splat(p.lambda * scale) * h) * ((d.j - splat(1.f)) * d.j));
  }

  // psi = mu sum (s_i - 1)^2 + lambda/2 (J - 1)^2
  static FIRN_INLINE Floats energy(const MaterialParams& p, const Deformation& d, Floats jp) {
    const Floats volumetric = splat(0.5f * p.lambda) * square(d.j - splat(1.f));
    return hardening(p, jp) * fma(splat(p.mu), norm2(stretch_of(d)), volumetric);
  }

  // Spatial speed of a uniaxial wave, F^2 (lambda + 2 mu) h / rho0.
  static FIRN_INLINE Floats wave_speed2(const MaterialParams& p, const Deformation& d, Floats jp) {
    const Floats stretch2 = max(splat(1.f), trace(d.e) + splat(1.f));
    return hardening(p, jp) * (splat((p.lambda + 2.f * p.mu) * p.inverse_density) * stretch2);
  }

  static FIRN_INLINE Mask yields(const MaterialParams& p, const Deformation& d, Floats) {
    return !inside_box(d, p.sigma_min, p.sigma_max);
  }

  // Stretches beyond [1 - theta_c, 1 + theta_s] become plastic; Jp hardens or softens what is left.
  static FIRN_INLINE Mask project(const MaterialParams& p, Mat3& f, Floats& jp, Mask active) {
    return clamp_into_jp(p, f, jp, active);
  }
};

}  // namespace firn::kernels::FIRN_ISA
