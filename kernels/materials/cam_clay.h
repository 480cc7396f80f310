// SPDX-License-Identifier: MIT
// Snow as a cohesive clay after Gaume et al. 2018, "Dynamic anticrack propagation in snow": tau = mu J^(-2/3)
// dev(B) + kappa/2 (J^2 - 1) I inside the ellipse a |s|^2 + M^2 (p + beta p0)(p - p0) <= 0, p = -tr(tau)/3,
// s = dev tau, a = 3/2 (1 + 2 beta). p0, the pressure at which it crushes, grows with compaction: p0 = kappa
// (1e-5 + sinh(xi max(-alpha, 0))), alpha = alpha0 + ln Jp. Pressures are counted in kappa here.
//
// A layer that collapses softens whichever way it yields, the paper's rule: alpha grows by |d ln J| until p0
// is gone, and with it the cohesion, beta = 0. Jp = -1 then, and -Jp is the volume ratio from there on: the
// layer closes, bearing next to nothing, by exp(-collapse), and hardens as it packs further, alpha = collapse
// + ln -Jp.
#pragma once
#include <cmath>

#include "kernels/materials/params.h"

namespace firn::kernels {

struct CamClay {
  static constexpr const char* kName = "cam_clay";

  struct Stated {
    double compressive_strength = 1e3;  // Pa, p0 at the start
    double cohesion_ratio = 0.3;        // beta: tensile strength / compressive strength
    // -ln of the volume ratio by which a layer closes once it has lost its cohesion; 0: it keeps cohesion
    double collapse = 0;
  };
  struct Params {
    float slope2 = 0;  // M^2
    float beta = 0;
    float alpha0 = 0;         // ln Jp before the start
    float collapse = 0;       // as stated
    float jp_broken = 1e30f;  // at which cohesion is gone
  };

  // M, largest von Mises stress / pressure at constant volume. Mohr-Coulomb in plane strain, as the cone of
  // grains: q = sqrt(3/2) |dev tau| and |dev tau| = sqrt(2) sin phi pressure.
  static double critical_slope(double friction_angle) {
    return std::sqrt(3.0) * std::sin(friction_angle * (M_PI / 180));
  }

  // p0 = kappa (1e-5 + sinh(-xi alpha0)), solved for alpha0.
  static double initial_compaction(double compressive_strength, double hardening, const LameModuli& e) {
    const double kappa = e.lambda + 2 * e.mu / 3;
    return -std::asinh(std::fmax(compressive_strength / kappa - 1e-5, 0.0)) / hardening;
  }

  static void fill(const auto& stated, const LameModuli& moduli, auto& params) {
    const double slope = critical_slope(stated.friction_angle);
    const double alpha0 = initial_compaction(stated.compressive_strength, stated.hardening, moduli);
    params.slope2 = static_cast<float>(slope * slope);
    params.beta = static_cast<float>(stated.cohesion_ratio);
    params.alpha0 = static_cast<float>(alpha0);
    params.collapse = static_cast<float>(stated.collapse);
    if (stated.collapse > 0)
      params.jp_broken = static_cast<float>(std::fmin(std::exp(-alpha0), stated.jp_max));
  }
};

}  // namespace firn::kernels

#ifdef FIRN_REFERENCE
#include "kernels/reference/matrix.h"

namespace firn::kernels::reference {

template <>
struct Twin<CamClay> {
  static double kappa_of(const auto& p) { return p.lambda + 2.0 / 3 * p.mu; }
  static double volume_of(const double f[9]) { return std::fmax(determinant(f), 0.01); }

  static void stress(const auto& p, const double f[9], double, double tau[9]) {
    times_transpose(f, f, tau);
    const double j = volume_of(f), mean = (tau[0] + tau[4] + tau[8]) / 3;
    for (int k = 0; k < 9; k += 4) tau[k] -= mean;
    for (int k = 0; k < 9; ++k) tau[k] *= p.mu * std::pow(j, -2.0 / 3);
    for (int k = 0; k < 9; k += 4) tau[k] += kappa_of(p) / 2 * (j * j - 1);
  }

  static double energy(const auto& p, const double f[9], double) {
    const double j = volume_of(f);
    return p.mu / 2 * (std::pow(j, -2.0 / 3) * norm2(f) - 3) +
           kappa_of(p) / 2 * ((j * j - 1) / 2 - std::log(j));
  }

  static double wave_speed2(const auto& p, const double f[9], double) {
    const double j = determinant(f), shrink = std::pow(volume_of(f), -2.0 / 3);
    return (kappa_of(p) / 2 * (j * j + 1) + 2.0 / 9 * p.mu * shrink * (stretch2_bound(f) + 5)) *
           p.inverse_density;
  }

  // Jp < 0 where a layer has lost its cohesion.
  static double cohesion(const auto& p, double jp) { return jp < 0 ? 0 : p.beta; }
  static double strength(const auto& p, double jp) {  // p0 / kappa
    const double alpha = (jp < 0 ? p.collapse : p.alpha0) + std::log(std::fabs(jp));
    return 1e-5 + std::sinh(std::fmin(p.hardening * std::fmax(-alpha, 0), 20));
  }

  static double hardened(const auto& p, double jp, double ratio) {
    if (jp < 0) return -clamped(-jp * ratio, p.jp_min, p.jp_max);
    if (p.collapse > 0) ratio = std::fmax(ratio, 1 / ratio);
    jp = clamped(jp * ratio, p.jp_min, p.jp_max);
    return jp < p.jp_broken ? jp : -1;
  }

  // The volume is kept exactly where it shears.
  static bool project(const auto& p, double f[9], double& jp) {
    double u[9], s[3], v[9], hat[3], j = 1, mean = 0, size2 = 0, sheared_j = 1;
    svd(f, u, s, v);
    bool flat = false;
    for (double& sigma : s) {
      flat = flat || sigma < 0.1;
      sigma = std::fmax(sigma, 0.1);
      j *= sigma;
      mean += sigma * sigma / 3;
    }
    for (int i = 0; i < 3; ++i) {
      hat[i] = s[i] * s[i] - mean;
      size2 += std::pow(p.mu * std::pow(j, -2.0 / 3) * hat[i], 2);
    }
    const double kappa = kappa_of(p), beta = cohesion(p, jp), p0 = kappa * strength(p, jp);
    const double pressure = -kappa / 2 * (j * j - 1), a = 1.5 * (1 + 2 * beta);
    const auto volume_at = [&](double at) { return std::sqrt(std::fmax(1 - 2 * at / kappa, 1e-3)); };
    double after = j;  // the volume that hardening counts
    if (pressure > p0 || pressure < -beta * p0) {
      after = volume_at(pressure > p0 ? p0 : -beta * p0);
      for (double& sigma : s) sigma = std::cbrt(after);
    } else if (a * size2 + p.slope2 * (pressure + beta * p0) * (pressure - p0) > 0) {
      const double allowed2 = p.slope2 * (pressure + beta * p0) * (p0 - pressure) / a;
      for (int i = 0; i < 3; ++i) sheared_j *= s[i] = std::sqrt(mean + hat[i] * std::sqrt(allowed2 / size2));
      for (double& sigma : s) sigma *= std::cbrt(j / sheared_j);
      const double centre = (1 - beta) * p0 / 2, off = pressure - centre;
      const double reach = std::sqrt(p.slope2 * off * off + a * size2);
      after = volume_at(centre + off * std::sqrt(p.slope2) * (1 + beta) * p0 / 2 / reach);
    } else if (!flat) {
      return false;
    }
    compose(u, s, v, f);
    jp = hardened(p, jp, j / after);
    return true;
  }
};

}  // namespace firn::kernels::reference
#endif

#ifdef FIRN_ISA
#include "kernels/mpm/stretch.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {

// sinh(x) of 0 <= x <= 20, also where exp(x) - exp(-x) would cancel.
FIRN_INLINE Floats sinh(Floats x) {
  const Floats x2 = x * x, e = exp(x);
  Floats p = fma(x2, splat(1.f / 362880), splat(1.f / 5040));
  p = fma(p, x2, splat(1.f / 120));
  p = fma(p, x2, splat(1.f / 6));
  return select(less(x, splat(1.f)), fma(p * x2, x, x), splat(0.5f) * (e - splat(1.f) / e));
}

template <>
struct Lanes<CamClay> {
  static FIRN_INLINE float kappa(const auto& p) { return p.lambda + p.mu * (2.f / 3); }

  // J^(-2/3); the volume ends at 0.01.
  static FIRN_INLINE Floats log_volume(const Deformation& d) { return log(max(d.j, splat(0.01f))); }
  static FIRN_INLINE Floats shrink(Floats log_j) { return exp(log_j * splat(-2.f / 3)); }

  static __attribute__((noinline)) Sym3 stress_of(const auto& p, float scale, const Mat3& f) {
    const Deformation d = deformation_of(f);
    const Floats mu = splat(p.mu * scale) * shrink(log_volume(d)), tr = trace(d.e) * splat(-1.f / 3);
    const Floats j = max(d.j, splat(0.01f));
    return add_diagonal(d.e * mu, fma(mu, tr, splat(0.5f * kappa(p) * scale) * fma(j, j, splat(-1.f))));
  }
  static FIRN_INLINE Sym3 stress(const auto& p, float scale, const Deformation& d, Floats) {
    return stress_of(p, scale, in_memory(d.f));
  }

  // psi = mu/2 (J^(-2/3) tr B - 3) + kappa/2 ((J^2 - 1)/2 - ln J)
  static __attribute__((noinline)) Floats energy_of(const auto& p, const Mat3& f) {
    const Deformation d = deformation_of(f);
    const Floats log_j = log_volume(d), j = max(d.j, splat(0.01f));
    const Floats volumetric = fma(fma(j, j, splat(-1.f)), splat(0.5f), -log_j);
    const Floats shear = fma(shrink(log_j), trace(d.e) + splat(3.f), splat(-3.f));
    return fma(splat(0.5f * p.mu), shear, splat(0.5f * kappa(p)) * volumetric);
  }
  static FIRN_INLINE Floats energy(const auto& p, const Deformation& d, Floats) {
    return energy_of(p, in_memory(d.f));
  }

  // Spatial speed of a uniaxial wave, F^2 dP/dF / rho0 = (kappa/2 (J^2 + 1) + 2/9 mu J^(-2/3) (F^2 + 5)) /
  // rho0, with the largest squared stretch bounded by |F|^2 - 2.
  static __attribute__((noinline)) Floats wave_speed2_of(const auto& p, const Mat3& f) {
    const Deformation d = deformation_of(f);
    const Floats stretch2 = max(splat(1.f), trace(d.e) + splat(1.f));
    const Floats shear = splat(p.mu * (2.f / 9)) * shrink(log_volume(d)) * (stretch2 + splat(5.f));
    return fma(splat(0.5f * kappa(p)), fma(d.j, d.j, splat(1.f)), shear) * splat(p.inverse_density);
  }
  static FIRN_INLINE Floats wave_speed2(const auto& p, const Deformation& d, Floats) {
    return wave_speed2_of(p, in_memory(d.f));
  }

  static FIRN_INLINE Mask broken(Floats jp) { return less(jp, splat(0.f)); }
  static FIRN_INLINE Floats beta(const auto& p, Floats jp) {
    return select(broken(jp), splat(0.f), splat(p.beta));
  }
  // a of the ellipse
  static FIRN_INLINE Floats shear_weight(Floats beta) {
    return splat(1.5f) * (splat(1.f) + splat(2.f) * beta);
  }

  // p0 / kappa
  static FIRN_INLINE Floats strength(const auto& p, Floats jp) {
    const Floats start = select(broken(jp), splat(p.collapse), splat(p.alpha0));
    const Floats packed = max(-(start + log(max(jp, -jp))), splat(0.f));
    return splat(1e-5f) + sinh(min(splat(p.hardening) * packed, splat(20.f)));
  }

  // Jp after the volume that hardening counts has changed by 1 / ratio.
  static FIRN_INLINE Floats hardened(const auto& p, Floats jp, Floats ratio) {
    const Mask was_broken = broken(jp);
    if (p.collapse > 0) ratio = select(was_broken, ratio, max(ratio, splat(1.f) / ratio));
    const Floats size = min(max(max(jp, -jp) * ratio, splat(p.jp_min)), splat(p.jp_max));
    const Mask breaks = less_equal(splat(p.jp_broken), size);
    return select(was_broken, -size, select(breaks, splat(-1.f), size));
  }

  // False only where `project` changes nothing: inside the ellipse by more than the round-off of either.
  static __attribute__((noinline)) Mask yields_of(const auto& p, const Mat3& f, Floats jp) {
    const Deformation d = deformation_of(f);
    const Floats p0 = strength(p, jp), pressure = splat(0.5f) * fma(-d.j, d.j, splat(1.f));
    const Floats size = splat(p.mu / kappa(p)) * shrink(log_volume(d)) *
                        sqrt(norm2(add_diagonal(d.e, trace(d.e) * splat(-1.f / 3))));
    const Floats cohesion = beta(p, jp), a = shear_weight(cohesion);
    constexpr float noise = 2e-6f;
    const Floats high = p0 - pressure, low = fma(cohesion, p0, pressure);
    const Floats margin =
        splat(noise) * (splat(2.f) * a * size + splat(p.slope2) * (high + low)) + splat(1e-11f);
    const Mask inside = less(splat(noise), high) & less(splat(noise), low) &
                        less(fma(a * size, size, margin), splat(p.slope2) * high * low);
    return !(inside & less(norm2(d.e), splat(0.25f)) & less(splat(0.3f), d.j));
  }
  static FIRN_INLINE Mask yields(const auto& p, const Deformation& d, Floats jp) {
    return yields_of(p, in_memory(d.f), jp);
  }

  // The pressure where the line from the ellipse's centre to (pressure, size) crosses it.
  static FIRN_INLINE Floats crossing(const auto& p, Floats cohesion, Floats p0, Floats pressure,
                                     Floats size) {
    const Floats one = splat(1.f), half_p0 = splat(0.5f) * p0;
    const Floats centre = half_p0 * (one - cohesion), half = half_p0 * (one + cohesion);
    const Floats along = pressure - centre;
    const Floats reach2 = fma(splat(p.slope2) * along, along, shear_weight(cohesion) * size * size);
    return fma(along, sqrt(splat(p.slope2)) * half / max(sqrt(reach2), splat(1e-20f)), centre);
  }

  struct Projected {
    Mask changed;
    Mat3 f;
    Floats volume_ratio;
  };
  static __attribute__((noinline)) Projected projected(const auto& p, const Mat3& f, Floats jp) {
    const Floats zero = splat(0.f), one = splat(1.f), third = splat(1.f / 3);
    Svd3 d;
    svd3(f, d);
    Floats s[3], b[3];
    Mask flat = less(one, zero);
    for (int i = 0; i < 3; ++i) {
      flat = flat | less(d.s[i], splat(0.1f));
      s[i] = max(d.s[i], splat(0.1f));  // flatter or inside out: as if of this stretch
      b[i] = s[i] * s[i];
    }
    const Floats j = s[0] * s[1] * s[2], mean = (b[0] + b[1] + b[2]) * third;
    const Floats p0 = strength(p, jp), pressure = splat(0.5f) * fma(-j, j, one);
    const Floats hat[3] = {b[0] - mean, b[1] - mean, b[2] - mean};
    const Floats hat_size = sqrt(fma(hat[0], hat[0], fma(hat[1], hat[1], hat[2] * hat[2])));
    const Floats size = splat(p.mu / kappa(p)) * shrink(log(j)) * hat_size;
    const Floats cohesion = beta(p, jp);
    const Floats high = p0 - pressure, low = fma(cohesion, p0, pressure);
    const Floats allowed2 = splat(p.slope2) / shear_weight(cohesion) * high * low;
    const Mask crushed = less(high, zero), torn = less(low, zero);
    const Mask tip = crushed | torn, shears = (!tip) & less(allowed2, size * size);
    // The tips: no shear, and the volume of the greatest or least pressure.
    const Floats end = select(crushed, p0, -(p0 * cohesion));
    const Floats tip_j = sqrt(max(fma(splat(-2.f), end, one), splat(1e-3f)));
    const Floats tip_s = exp(log(tip_j) * third);
    // Shear: the same volume, less deviator.
    const Floats keep = sqrt(max(allowed2, zero)) / max(size, splat(1e-20f));
    Floats sheared[3];
    for (int i = 0; i < 3; ++i) sheared[i] = sqrt(fma(hat[i], keep, mean));
    const Floats same_volume = exp(log(j / (sheared[0] * sheared[1] * sheared[2])) * third);
    const Floats cross_j =
        sqrt(max(fma(splat(-2.f), crossing(p, cohesion, p0, pressure, size), one), splat(1e-3f)));
    for (int i = 0; i < 3; ++i) s[i] = select(tip, tip_s, select(shears, sheared[i] * same_volume, s[i]));
    return {flat | tip | shears, compose(d, s), select(tip, j / tip_j, select(shears, j / cross_j, one))};
  }

  static FIRN_INLINE Mask project(const auto& p, Mat3& f, Floats& jp, Mask active) {
    const Projected to = projected(p, in_memory(f), jp);
    const Mask changed = active & to.changed;
    f = select(changed, to.f, f);
    jp = select(changed, hardened(p, jp, to.volume_ratio), jp);
    return changed;
  }
};

}  // namespace firn::kernels::FIRN_ISA
#endif
