// SPDX-License-Identifier: MIT
// Neo-Hookean elasticity: tau = mu (F F^T - I) + lambda ln(J) I, psi = mu/2 (|F|^2 - 3) - mu ln J + lambda/2
// ln^2 J; with the clamp of the source paper.
#pragma once
#include "kernels/materials/params.h"

namespace firn::kernels {

struct NeoHookean {
  static constexpr const char* kName = "neo_hookean";

  struct Stated {
    double sigma_min = 0.975, sigma_max = 1.0075;  // singular values of F are kept between
  };
  struct Params {};

  static void fill(const auto& stated, const LameModuli&, auto& params) {
    params.sigma_min = static_cast<float>(stated.sigma_min);
    params.sigma_max = static_cast<float>(stated.sigma_max);
  }
};

}  // namespace firn::kernels

#ifdef FIRN_REFERENCE
#include <cmath>

#include "kernels/reference/matrix.h"

namespace firn::kernels::reference {

template <>
struct Twin<NeoHookean> {
  static double log_volume(const double f[9]) { return std::log(std::fmax(determinant(f), 0.01)); }

  static void stress(const auto& p, const double f[9], double, double tau[9]) {
    times_transpose(f, f, tau);
    for (int k = 0; k < 9; ++k) tau[k] *= p.mu;
    for (int k = 0; k < 9; k += 4) tau[k] += p.lambda * log_volume(f) - p.mu;
  }

  static double energy(const auto& p, const double f[9], double) {
    const double log_j = log_volume(f);
    return 0.5 * p.mu * (norm2(f) - 3) - p.mu * log_j + 0.5 * p.lambda * log_j * log_j;
  }

  static double wave_speed2(const auto& p, const double f[9], double) {
    const double pressed = std::fmax(0, -log_volume(f));
    return (p.mu * (1 + stretch2_bound(f)) + p.lambda * (1 + pressed)) * p.inverse_density;
  }

  static bool project(const auto& p, double f[9], double& jp) { return clamp_stretches(p, f, jp); }
};

}  // namespace firn::kernels::reference
#endif

#ifdef FIRN_ISA
#include "kernels/mpm/clamp.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {

template <>
struct Lanes<NeoHookean> {
  // The logarithm ends at J = 0.01: an element that is flatter, or inside out, keeps the greatest finite
  // pressure.
  static FIRN_INLINE Floats log_volume(const Deformation& d) { return log(max(d.j, splat(0.01f))); }

  static FIRN_INLINE Sym3 stress(const auto& p, float scale, const Deformation& d, Floats) {
    return add_diagonal(d.e * splat(p.mu * scale), splat(p.lambda * scale) * log_volume(d));
  }

  static FIRN_INLINE Floats energy(const auto& p, const Deformation& d, Floats) {
    const Floats log_j = log_volume(d);
    return splat(0.5f * p.mu) * trace(d.e) + log_j * (splat(0.5f * p.lambda) * log_j - splat(p.mu));
  }

  // Spatial speed of a uniaxial wave, F^2 dP/dF / rho0 = (mu (F^2 + 1) + lambda (1 - ln F)) / rho0, with the
  // largest squared stretch bounded by |F|^2 - 2.
  static FIRN_INLINE Floats wave_speed2(const auto& p, const Deformation& d, Floats) {
    const Floats one = splat(1.f);
    const Floats stretch2 = max(one, trace(d.e) + one);
    const Floats bulk = splat(p.lambda) * (one + max(splat(0.f), -log_volume(d)));
    return (splat(p.mu) * (one + stretch2) + bulk) * splat(p.inverse_density);
  }

  static FIRN_INLINE Mask yields(const auto& p, const Deformation& d, Floats) {
    return !inside_box(d, p.sigma_min, p.sigma_max);
  }

  // The clamp of the source paper; Jp is kept for the density only.
  static FIRN_INLINE Mask project(const auto& p, Mat3& f, Floats& jp, Mask active) {
    return clamp_into_jp(p, f, jp, active);
  }
};

}  // namespace firn::kernels::FIRN_ISA
#endif
