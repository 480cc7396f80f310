// SPDX-License-Identifier: MIT
// Stress, energy and yield of each material, straight from the definitions.
#include <cmath>

#include "kernels/reference/mpm.h"

namespace firn::kernels::reference {

namespace {

// out = a b^T
void times_transpose(const double a[9], const double b[9], double out[9]) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      out[3 * r + c] = 0;
      for (int k = 0; k < 3; ++k) out[3 * r + c] += a[3 * r + k] * b[3 * c + k];
    }
  }
}

void compose(const double u[9], const double s[3], const double v[9], double out[9]) {
  double us[9];
  for (int k = 0; k < 9; ++k) us[k] = u[k] * s[k % 3];
  times_transpose(us, v, out);
}

// ln of the singular values, which end at 0.01 as in the kernel; returns their sum.
double log_stretches(const double s[3], double log_s[3]) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += log_s[i] = std::log(std::fmax(s[i], 0.01));
  return sum;
}

// Klar et al. 2016, with the gap of grains that have parted, vc = ln Jp, spread over the axes.
bool project_grains(const MaterialParams& p, double f[9], double& jp) {
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

double clamped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

double kappa_of(const MaterialParams& p) { return p.lambda + 2.0 / 3 * p.mu; }

// mu J^(-2/3) dev(S^2) + kappa/2 (J^2 - 1) I in the axes of S.
void clay_stress(const MaterialParams& p, const double f[9], double tau[9]) {
  times_transpose(f, f, tau);
  const double j = std::fmax(determinant(f), 0.01), mean = (tau[0] + tau[4] + tau[8]) / 3;
  for (int k = 0; k < 9; k += 4) tau[k] -= mean;
  for (int k = 0; k < 9; ++k) tau[k] *= p.mu * std::pow(j, -2.0 / 3);
  for (int k = 0; k < 9; k += 4) tau[k] += kappa_of(p) / 2 * (j * j - 1);
}

double clay_energy(const MaterialParams& p, const double f[9]) {
  const double j = std::fmax(determinant(f), 0.01);
  double norm2 = 0;
  for (int k = 0; k < 9; ++k) norm2 += f[k] * f[k];
  return p.mu / 2 * (std::pow(j, -2.0 / 3) * norm2 - 3) + kappa_of(p) / 2 * ((j * j - 1) / 2 - std::log(j));
}

// Cohesion and p0 / kappa of clay; Jp < 0 where a layer has lost its cohesion.
double clay_cohesion(const MaterialParams& p, double jp) { return jp < 0 ? 0 : p.cohesion; }
double clay_strength(const MaterialParams& p, double jp) {
  const double alpha = (jp < 0 ? p.collapse : p.alpha0) + std::log(std::fabs(jp));
  return 1e-5 + std::sinh(std::fmin(p.hardening * std::fmax(-alpha, 0), 20));
}

double hardened_clay(const MaterialParams& p, double jp, double ratio) {
  if (jp < 0) return -clamped(-jp * ratio, p.jp_min, p.jp_max);
  if (p.collapse > 0) ratio = std::fmax(ratio, 1 / ratio);
  jp = clamped(jp * ratio, p.jp_min, p.jp_max);
  return jp < p.jp_broken ? jp : -1;
}

// Gaume et al. 2018, the volume kept exactly where it shears.
bool project_clay(const MaterialParams& p, double f[9], double& jp) {
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
  const double kappa = kappa_of(p), beta = clay_cohesion(p, jp), p0 = kappa * clay_strength(p, jp);
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
  jp = hardened_clay(p, jp, j / after);
  return true;
}

}  // namespace

void stress(const MaterialParams& p, const double f[9], double jp, double tau[9]) {
  if (p.kind == kCamClay) return clay_stress(p, f, tau);
  const double j = determinant(f);
  if (p.kind == kNeoHookean) {  // mu (F F^T - I) + lambda ln J I
    times_transpose(f, f, tau);
    for (int k = 0; k < 9; ++k) tau[k] *= p.mu;
    for (int k = 0; k < 9; k += 4) tau[k] += p.lambda * std::log(std::fmax(j, 0.01)) - p.mu;
    return;
  }
  double u[9], s[3], v[9], r[9], less_r[9];
  svd(f, u, s, v);
  if (p.kind == kDruckerPrager) {  // U (2 mu ln S + lambda tr(ln S) I) U^T
    double l[3], ul[9];
    const double sum = log_stretches(s, l);
    for (int k = 0; k < 9; ++k) ul[k] = u[k] * (2 * p.mu * l[k % 3] + p.lambda * sum);
    times_transpose(ul, u, tau);
    return;
  }
  const double hardening = std::exp(p.hardening * (1 - jp));
  times_transpose(u, v, r);  // R = U V^T
  for (int k = 0; k < 9; ++k) less_r[k] = f[k] - r[k];
  times_transpose(less_r, f, tau);  // 2 mu (F - R) F^T + lambda (J - 1) J I
  for (int k = 0; k < 9; ++k) tau[k] *= 2 * p.mu * hardening;
  for (int k = 0; k < 9; k += 4) tau[k] += p.lambda * hardening * (j - 1) * j;
}

double energy(const MaterialParams& p, const double f[9], double jp) {
  if (p.kind == kCamClay) return clay_energy(p, f);
  const double j = determinant(f);
  if (p.kind == kNeoHookean) {
    double norm2 = 0;
    for (int k = 0; k < 9; ++k) norm2 += f[k] * f[k];
    const double log_j = std::log(std::fmax(j, 0.01));
    return 0.5 * p.mu * (norm2 - 3) - p.mu * log_j + 0.5 * p.lambda * log_j * log_j;
  }
  double u[9], s[3], v[9], stretch = 0;
  svd(f, u, s, v);
  if (p.kind == kDruckerPrager) {  // mu |ln S|^2 + lambda/2 tr(ln S)^2
    double l[3];
    const double sum = log_stretches(s, l);
    return p.mu * (l[0] * l[0] + l[1] * l[1] + l[2] * l[2]) + 0.5 * p.lambda * sum * sum;
  }
  for (const double sigma : s) stretch += (sigma - 1) * (sigma - 1);
  return std::exp(p.hardening * (1 - jp)) * (p.mu * stretch + 0.5 * p.lambda * (j - 1) * (j - 1));
}

double wave_speed2(const MaterialParams& p, const double f[9], double jp) {
  double norm2 = 0;
  for (int k = 0; k < 9; ++k) norm2 += f[k] * f[k];
  const double stretch2 = std::fmax(1, norm2 - 2);
  if (p.kind == kNeoHookean) {
    const double pressed = std::fmax(0, -std::log(std::fmax(determinant(f), 0.01)));
    return (p.mu * (1 + stretch2) + p.lambda * (1 + pressed)) * p.inverse_density;
  }
  if (p.kind == kCamClay) {
    const double j = determinant(f), shrink = std::pow(std::fmax(j, 0.01), -2.0 / 3);
    return (kappa_of(p) / 2 * (j * j + 1) + 2.0 / 9 * p.mu * shrink * (stretch2 + 5)) * p.inverse_density;
  }
  if (p.kind == kDruckerPrager) {
    double b[9], e2 = 0;
    times_transpose(f, f, b);
    for (int k = 0; k < 9; ++k) e2 += (b[k] - (k % 4 == 0)) * (b[k] - (k % 4 == 0));
    const double least = std::sqrt(std::fmax(1 - std::sqrt(e2), 1e-4));
    return (p.lambda + 2 * p.mu) * (1 - std::log(least)) * p.inverse_density;
  }
  return std::exp(p.hardening * (1 - jp)) * (p.lambda + 2 * p.mu) * stretch2 * p.inverse_density;
}

bool project(const MaterialParams& p, double f[9], double& jp) {
  if (p.kind == kDruckerPrager) return project_grains(p, f, jp);
  if (p.kind == kCamClay) return project_clay(p, f, jp);
  double u[9], s[3], v[9];
  svd(f, u, s, v);
  double before = 1, after = 1;
  bool changed = false;
  for (double& sigma : s) {
    const double inside = clamped(sigma, p.sigma_min, p.sigma_max);
    changed = changed || inside != sigma;
    before *= sigma;
    after *= inside;
    sigma = inside;
  }
  if (!changed) return false;
  compose(u, s, v, f);
  jp = clamped(jp * before / after, p.jp_min, p.jp_max);
  return true;
}

}  // namespace firn::kernels::reference
