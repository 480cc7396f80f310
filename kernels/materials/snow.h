// SPDX-License-Identifier: MIT
// Snow after Stomakhin et al. 2013, sections 5 and 6: fixed corotated, tau = 2 mu (F - R) F^T + lambda (J -
// 1) J I, with mu and lambda scaled by exp(xi (1 - Jp)).
#pragma once
#include "kernels/materials/params.h"

namespace firn::kernels {

struct Snow {
  static constexpr const char* kName = "snow";

  // Singular values of F are kept in [1 - critical_compression, 1 + critical_stretch].
  struct Stated {
    double critical_compression = 2.5e-2;  // theta_c
    double critical_stretch = 7.5e-3;      // theta_s
  };
  struct Params {};

  static void fill(const auto& stated, const LameModuli&, auto& params) {
    params.sigma_min = static_cast<float>(1 - stated.critical_compression);
    params.sigma_max = static_cast<float>(1 + stated.critical_stretch);
  }
};

}  // namespace firn::kernels

#ifdef FIRN_REFERENCE
#include <cmath>

#include "kernels/reference/matrix.h"

namespace firn::kernels::reference {

template <>
struct Twin<Snow> {
  static double hardening(const auto& p, double jp) { return std::exp(p.hardening * (1 - jp)); }

  // 2 mu (F - R) F^T + lambda (J - 1) J I, R = U V^T
  static void stress(const auto& p, const double f[9], double jp, double tau[9]) {
    double u[9], s[3], v[9], r[9], less_r[9];
    const double h = hardening(p, jp), j = determinant(f);
    svd(f, u, s, v);
    times_transpose(u, v, r);
    for (int k = 0; k < 9; ++k) less_r[k] = f[k] - r[k];
    times_transpose(less_r, f, tau);
    for (int k = 0; k < 9; ++k) tau[k] *= 2 * p.mu * h;
    for (int k = 0; k < 9; k += 4) tau[k] += p.lambda * h * (j - 1) * j;
  }

  static double energy(const auto& p, const double f[9], double jp) {
    double u[9], s[3], v[9], stretch = 0;
    const double j = determinant(f);
    svd(f, u, s, v);
    for (const double sigma : s) stretch += (sigma - 1) * (sigma - 1);
    return hardening(p, jp) * (p.mu * stretch + 0.5 * p.lambda * (j - 1) * (j - 1));
  }

  static double wave_speed2(const auto& p, const double f[9], double jp) {
    return hardening(p, jp) * (p.lambda + 2 * p.mu) * stretch2_bound(f) * p.inverse_density;
  }

  static bool project(const auto& p, double f[9], double& jp) { return clamp_stretches(p, f, jp); }
};

}  // namespace firn::kernels::reference
#endif

#ifdef FIRN_ISA
#include "kernels/mpm/clamp.h"
#include "kernels/mpm/stretch.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {

// With E = F F^T - I and G = sqrt(F F^T) - I, 2 mu (F - R) F^T is 2 mu (G + G^2) = 2 mu (E - G).
template <>
struct Lanes<Snow> {
  static FIRN_INLINE Floats hardening(const auto& p, Floats jp) {
    return exp(splat(p.hardening) * (splat(1.f) - jp));
  }

  static FIRN_INLINE Sym3 stress(const auto& p, float scale, const Deformation& d, Floats jp) {
    const Floats h = hardening(p, jp);
    return corotated_stress(d, splat(2.f * p.mu * scale) * h,
                            (splat(p.lambda * scale) * h) * ((d.j - splat(1.f)) * d.j));
  }

  // psi = mu sum (s_i - 1)^2 + lambda/2 (J - 1)^2
  static FIRN_INLINE Floats energy(const auto& p, const Deformation& d, Floats jp) {
    const Floats volumetric = splat(0.5f * p.lambda) * square(d.j - splat(1.f));
    return hardening(p, jp) * fma(splat(p.mu), norm2(stretch_of(d)), volumetric);
  }

  // Spatial speed of a uniaxial wave, F^2 (lambda + 2 mu) h / rho0.
  static FIRN_INLINE Floats wave_speed2(const auto& p, const Deformation& d, Floats jp) {
    const Floats stretch2 = max(splat(1.f), trace(d.e) + splat(1.f));
    return hardening(p, jp) * (splat((p.lambda + 2.f * p.mu) * p.inverse_density) * stretch2);
  }

  static FIRN_INLINE Mask yields(const auto& p, const Deformation& d, Floats) {
    return !inside_box(d, p.sigma_min, p.sigma_max);
  }

  // Stretches beyond [1 - theta_c, 1 + theta_s] become plastic; Jp hardens or softens what is left.
  static FIRN_INLINE Mask project(const auto& p, Mat3& f, Floats& jp, Mask active) {
    return clamp_into_jp(p, f, jp, active);
  }
};

}  // namespace firn::kernels::FIRN_ISA
#endif
