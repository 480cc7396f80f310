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

  static FIRN_INLINE Sym3 stress(const MaterialParams& p, const Mat3& f, Floats jp) {
    const Floats h = hardening(p, jp), j = det(f);
    const Sym3 e = strain_of(f), g = stretch_of(f, e, j);
    return add_diagonal((e - g) * (splat(2.f * p.mu) * h), splat(p.lambda) * h * (j - splat(1.f)) * j);
  }

  // psi = mu sum (s_i - 1)^2 + lambda/2 (J - 1)^2
  static FIRN_INLINE Floats energy(const MaterialParams& p, const Mat3& f, Floats jp) {
    const Floats j = det(f);
    const Sym3 g = stretch_of(f, strain_of(f), j);
    return hardening(p, jp) * fma(splat(p.mu), norm2(g), splat(0.5f * p.lambda) * square(j - splat(1.f)));
  }

  // Spatial speed of a uniaxial wave, F^2 (lambda + 2 mu) h / rho0.
  static FIRN_INLINE Floats wave_speed2(const MaterialParams& p, const Mat3& f, Floats jp) {
    const Floats stretch2 = max(splat(1.f), norm2(f) - splat(2.f));
    return hardening(p, jp) * (splat((p.lambda + 2.f * p.mu) * p.inverse_density) * stretch2);
  }

  static FIRN_INLINE Mask yields(const MaterialParams& p, const Mat3& f) {
    return !inside_box(f, splat(p.sigma_min), splat(p.sigma_max));
  }

  // Stretches beyond [1 - theta_c, 1 + theta_s] become plastic; Jp hardens or softens what is left.
  static FIRN_INLINE Mask project(const MaterialParams& p, Mat3& f, Floats& jp, Mask active) {
    return clamp_into_jp(p, f, jp, active);
  }
};

}  // namespace firn::kernels::FIRN_ISA
