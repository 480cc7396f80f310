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
#include "kernels/mpm/stretch.h"
#include "kernels/mpm/views.h"
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

struct DruckerPrager {
  static FIRN_INLINE Sym3 stress(const MaterialParams& p, float scale, const Deformation& d, Floats) {
    const Sym3 l = hencky_strain(in_memory(d.f));
    return add_diagonal(l * splat(2.f * p.mu * scale), splat(p.lambda * scale) * trace(l));
  }

  // psi = mu |L|^2 + lambda/2 tr(L)^2
  static FIRN_INLINE Floats energy(const MaterialParams& p, const Deformation& d, Floats) {
    const Sym3 l = hencky_strain(in_memory(d.f));
    return fma(splat(p.mu), norm2(l), splat(0.5f * p.lambda) * square(trace(l)));
  }

  // Spatial speed of a uniaxial wave, F^2 dP/dF / rho0 = (lambda + 2 mu) (1 - ln F) / rho0, with the least
  // squared stretch bounded by 1 - |E|.
  static FIRN_INLINE Floats wave_speed2(const MaterialParams& p, const Deformation& d, Floats) {
    const Floats least2 = max(splat(1.f) - sqrt(norm2(d.e)), splat(kLeastStretch * kLeastStretch));
    return fma(log(least2), splat(-0.5f), splat(1.f)) * splat((p.lambda + 2.f * p.mu) * p.inverse_density);
  }

  // False only where `project` changes nothing: inside the cone by more than the round-off of either.
  static __attribute__((noinline)) Mask yields_of(const MaterialParams& p, const Mat3& f, Floats jp) {
    const Deformation d = deformation_of(f);
    const Sym3 l = hencky_series(d);
    const Floats tr = trace(l) - splat(3.f * p.cohesion);
    const Floats deviator = sqrt(norm2(add_diagonal(l, trace(l) * splat(-1.f / 3))));
    const Floats margin = splat(-4e-6f * (1.f + p.cone));
    const Mask inside = less(tr, margin) & less(fma(splat(p.cone), tr, deviator), margin);
    return !(inside & near_rotation(d) & less_equal(jp, splat(1.f)));
  }
  static FIRN_INLINE Mask yields(const MaterialParams& p, const Deformation& d, Floats jp) {
    return yields_of(p, in_memory(d.f), jp);
  }

  struct Projected {
    Mask changed;
    Mat3 f;
    Floats jp;
  };
  static __attribute__((noinline)) Projected projected(const MaterialParams& p, const Mat3& f, Floats jp) {
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
  static FIRN_INLINE Mask project(const MaterialParams& p, Mat3& f, Floats& jp, Mask active) {
    const Projected to = projected(p, in_memory(f), jp);
    const Mask changed = active & to.changed;
    f = select(changed, to.f, f);
    jp = select(changed, to.jp, jp);
    return changed;
  }
};

}  // namespace firn::kernels::FIRN_ISA
