// SPDX-License-Identifier: MIT
// Sand and other grains after Klar et al. 2016, "Drucker-Prager elastoplasticity for sand animation": Hencky
// elasticity, tau = 2 mu L + lambda tr(L) I with L = ln sqrt(F F^T), inside the cone |dev L| <= -k tr(L - c
// I).
//
// Jp is exp(vc), the volume by which grains have parted: 1 where they touch. They press again only after they
// have come together (Klar's volume correction), so Jp never falls below 1, and J Jp is the volume that they
// take up. Cohesion c holds grains that touch; parting takes all tension away at once, and grains that have
// parted stick again when they touch. So no projection ever adds energy.
#pragma once
#include <cmath>

#include "kernels/materials/params.h"

namespace firn::kernels {

struct DruckerPrager {
  static constexpr const char* kName = "drucker_prager";

  struct Stated {
    double cohesion = 0;  // c: ln of the stretch, equal in all directions, that parts grains that touch
  };
  struct Params {
    float cone = 0;      // k
    float cohesion = 0;  // c
  };

  // |dev tau| <= 3 alpha pressure, which is alpha (3 lambda + 2 mu) (-tr L); |dev tau| = 2 mu |dev L|. Sand
  // on a slope deforms in a plane, where the middle principal stress is the mean of the others and
  // Mohr-Coulomb reads alpha = sqrt(2)/3 sin phi. The fit of Klar et al. 2016, sqrt(2/3) 2 sin phi / (3 - sin
  // phi), is that of triaxial compression: with it, sand of 30 degrees stands at 44.
  static double cone_slope(double friction_angle, const LameModuli& e) {
    const double alpha = std::sqrt(2.0) / 3 * std::sin(friction_angle * (M_PI / 180));
    return alpha * (3 * e.lambda + 2 * e.mu) / (2 * e.mu);
  }

  static void fill(const auto& stated, const LameModuli& moduli, auto& params) {
    params.cone = static_cast<float>(cone_slope(stated.friction_angle, moduli));
    params.cohesion = static_cast<float>(stated.cohesion);
  }
};

}  // namespace firn::kernels

#ifdef FIRN_REFERENCE
#include "kernels/reference/matrix.h"

namespace firn::kernels::reference {

template <>
struct Twin<DruckerPrager> {
  // ln of the singular values, which end at 0.01 as in the kernel; returns their sum.
  static double log_stretches(const double s[3], double log_s[3]) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += log_s[i] = std::log(std::fmax(s[i], 0.01));
    return sum;
  }

  // U (2 mu ln S + lambda tr(ln S) I) U^T
  static void stress(const auto& p, const double f[9], double, double tau[9]) {
    double u[9], s[3], v[9], l[3], ul[9];
    svd(f, u, s, v);
    const double sum = log_stretches(s, l);
    for (int k = 0; k < 9; ++k) ul[k] = u[k] * (2 * p.mu * l[k % 3] + p.lambda * sum);
    times_transpose(ul, u, tau);
  }

  // mu |ln S|^2 + lambda/2 tr(ln S)^2
  static double energy(const auto& p, const double f[9], double) {
    double u[9], s[3], v[9], l[3];
    svd(f, u, s, v);
    const double sum = log_stretches(s, l);
    return p.mu * (l[0] * l[0] + l[1] * l[1] + l[2] * l[2]) + 0.5 * p.lambda * sum * sum;
  }

  static double wave_speed2(const auto& p, const double f[9], double) {
    double e[9];
    times_transpose(f, f, e);
    for (int k = 0; k < 9; k += 4) e[k] -= 1;
    const double least = std::sqrt(std::fmax(1 - std::sqrt(norm2(e)), 1e-4));
    return (p.lambda + 2 * p.mu) * (1 - std::log(least)) * p.inverse_density;
  }

  // The gap of grains that have parted, vc = ln Jp, is spread over the axes.
  static bool project(const auto& p, double f[9], double& jp) {
    double u[9], s[3], v[9], l[3], hat[3], size = 0;
    svd(f, u, s, v);
    const double sum = log_stretches(s, l), vc = std::log(jp), cohesion = vc > 0 ? 0 : p.cohesion;
    const double tr = sum + vc - 3 * cohesion;
    for (int i = 0; i < 3; ++i) {
      hat[i] = l[i] - sum / 3;
      size += hat[i] * hat[i];
    }
    size = std::sqrt(size);
    const double excess = size + p.cone * tr;
    if (tr < 0 && excess <= 0 && vc <= 0 && s[2] >= 0.01) return false;
    for (int i = 0; i < 3; ++i) {
      const double kept = excess > 0 ? hat[i] * (1 - excess / size) : hat[i];
      s[i] = tr >= 0 ? 1 : std::exp(kept + (sum + vc) / 3);
    }
    compose(u, s, v, f);
    jp = tr >= 0 ? std::fmin(std::exp(std::fmax(sum + vc, 0)), p.jp_max) : 1;
    return true;
  }
};

}  // namespace firn::kernels::reference
#endif

#ifdef FIRN_ISA
#include "kernels/mpm/stretch.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {

// The logarithm ends here: an element that is flatter, or inside out, counts as one of this stretch.
inline constexpr float kLeastStretch = 0.01f;
FIRN_INLINE Floats log_stretch(Floats s) { return log(max(s, splat(kLeastStretch))); }

// ln(1 + e) / 2 = a1 e + .. + a7 e^7, off by e^8 / 16 at most: 6e-10 within kSeriesRadius.
FIRN_INLINE Sym3 hencky_series(const Deformation& d) {
  const Sym3 e2 = commuting_product(d.e, d.e);
  const Floats first = trace(d.e), half = splat(0.5f);
  const Invariants i{first, half * fma(-first, first, trace(e2)), determinant(d.e)};
  Quadratic p{splat(0.1f), splat(-1.f / 12), splat(1.f / 14)};
  p = times_e_plus(p, i, -0.125f);
  p = times_e_plus(p, i, 1.f / 6);
  p = times_e_plus(p, i, -0.25f);
  p = times_e_plus(p, i, 0.5f);
  return evaluate(times_e_plus(p, i, 0.f), d.e, e2);
}

__attribute__((noinline, cold)) inline Sym3 hencky_by_svd(const Mat3& f) {
  Svd3 d;
  svd3(f, d);
  return along_left_axes(d, log_stretch(d.s[0]), log_stretch(d.s[1]), log_stretch(d.s[2]));
}

// L. Not inlined, so that the kernels of other materials stay as they are.
__attribute__((noinline)) inline Sym3 hencky_strain(const Mat3& f) {
  const Deformation d = deformation_of(f);
  const Mask near = near_rotation(d);
  const Sym3 series = hencky_series(d);
  if (all(near)) [[likely]]
    return series;
  return select(near, series, hencky_by_svd(f));
}

template <>
struct Lanes<DruckerPrager> {
  static FIRN_INLINE Sym3 stress(const auto& p, float scale, const Deformation& d, Floats) {
    const Sym3 l = hencky_strain(in_memory(d.f));
    return add_diagonal(l * splat(2.f * p.mu * scale), splat(p.lambda * scale) * trace(l));
  }

  // psi = mu |L|^2 + lambda/2 tr(L)^2
  static FIRN_INLINE Floats energy(const auto& p, const Deformation& d, Floats) {
    const Sym3 l = hencky_strain(in_memory(d.f));
    return fma(splat(p.mu), norm2(l), splat(0.5f * p.lambda) * square(trace(l)));
  }

  // Spatial speed of a uniaxial wave, F^2 dP/dF / rho0 = (lambda + 2 mu) (1 - ln F) / rho0, with the least
  // squared stretch bounded by 1 - |E|.
  static FIRN_INLINE Floats wave_speed2(const auto& p, const Deformation& d, Floats) {
    const Floats least2 = max(splat(1.f) - sqrt(norm2(d.e)), splat(kLeastStretch * kLeastStretch));
    return fma(log(least2), splat(-0.5f), splat(1.f)) * splat((p.lambda + 2.f * p.mu) * p.inverse_density);
  }

  // False only where `project` changes nothing: inside the cone by more than the round-off of either.
  static __attribute__((noinline)) Mask yields_of(const auto& p, const Mat3& f, Floats jp) {
    const Deformation d = deformation_of(f);
    const Sym3 l = hencky_series(d);
    const Floats tr = trace(l) - splat(3.f * p.cohesion);
    const Floats deviator = sqrt(norm2(add_diagonal(l, trace(l) * splat(-1.f / 3))));
    const Floats margin = splat(-4e-6f * (1.f + p.cone));
    const Mask inside = less(tr, margin) & less(fma(splat(p.cone), tr, deviator), margin);
    return !(inside & near_rotation(d) & less_equal(jp, splat(1.f)));
  }
  static FIRN_INLINE Mask yields(const auto& p, const Deformation& d, Floats jp) {
    return yields_of(p, in_memory(d.f), jp);
  }

  struct Projected {
    Mask changed;
    Mat3 f;
    Floats jp;
  };
  static __attribute__((noinline)) Projected projected(const auto& p, const Mat3& f, Floats jp) {
    const Floats zero = splat(0.f), one = splat(1.f);
    Svd3 d;
    svd3(f, d);
    const Mask parted = less(one, jp);
    const Floats shift = select(parted, log(jp) * splat(1.f / 3), splat(-p.cohesion));
    Floats s[3], log_s[3];
    Mask changed = parted;
    for (int i = 0; i < 3; ++i) {
      changed = changed | less(d.s[i], splat(kLeastStretch));
      s[i] = max(d.s[i], splat(kLeastStretch));
      log_s[i] = log(s[i]);
    }
    const Floats tr = ((log_s[0] + log_s[1]) + log_s[2]) + shift * splat(3.f);
    const Floats sum = ((log_s[0] + log_s[1]) + log_s[2]), mean = sum * splat(1.f / 3);
    const Floats hat[3] = {log_s[0] - mean, log_s[1] - mean, log_s[2] - mean};
    const Floats size = sqrt(fma(hat[0], hat[0], fma(hat[1], hat[1], hat[2] * hat[2])));
    const Floats excess = fma(splat(p.cone), tr, size);
    const Mask apart = less_equal(zero, tr), shears = less(zero, excess);
    const Floats keep = select(shears, one - excess / max(size, splat(1e-20f)), one);
    const Floats closing = select(parted, shift, zero);  // what is left of the gap, spread over the axes
    const Floats volume = ((s[0] * s[1]) * s[2]) * jp;
    for (int i = 0; i < 3; ++i) s[i] = select(apart, one, exp(fma(hat[i], keep, mean + closing)));
    return {changed | apart | shears, compose(d, s),
            select(apart, min(max(volume, one), splat(p.jp_max)), one)};
  }

  // Grains that part keep no strain; grains that slide keep their volume and come back to the cone.
  static FIRN_INLINE Mask project(const auto& p, Mat3& f, Floats& jp, Mask active) {
    const Projected to = projected(p, in_memory(f), jp);
    const Mask changed = active & to.changed;
    f = select(changed, to.f, f);
    jp = select(changed, to.jp, jp);
    return changed;
  }
};

}  // namespace firn::kernels::FIRN_ISA
#endif
