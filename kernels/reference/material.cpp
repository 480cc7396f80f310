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

double clamped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

}  // namespace

void stress(const MaterialParams& p, const double f[9], double jp, double tau[9]) {
  const double j = determinant(f);
  if (p.kind == kNeoHookean) {  // mu (F F^T - I) + lambda ln J I
    times_transpose(f, f, tau);
    for (int k = 0; k < 9; ++k) tau[k] *= p.mu;
    for (int k = 0; k < 9; k += 4) tau[k] += p.lambda * std::log(std::fmax(j, 0.01)) - p.mu;
    return;
  }
  const double hardening = std::exp(p.hardening * (1 - jp));
  double u[9], s[3], v[9], r[9], less_r[9];
  svd(f, u, s, v);
  times_transpose(u, v, r);  // R = U V^T
  for (int k = 0; k < 9; ++k) less_r[k] = f[k] - r[k];
  times_transpose(less_r, f, tau);  // 2 mu (F - R) F^T + lambda (J - 1) J I
  for (int k = 0; k < 9; ++k) tau[k] *= 2 * p.mu * hardening;
  for (int k = 0; k < 9; k += 4) tau[k] += p.lambda * hardening * (j - 1) * j;
}

double energy(const MaterialParams& p, const double f[9], double jp) {
  const double j = determinant(f);
  if (p.kind == kNeoHookean) {
    double norm2 = 0;
    for (int k = 0; k < 9; ++k) norm2 += f[k] * f[k];
    const double log_j = std::log(std::fmax(j, 0.01));
    return 0.5 * p.mu * (norm2 - 3) - p.mu * log_j + 0.5 * p.lambda * log_j * log_j;
  }
  double u[9], s[3], v[9], stretch = 0;
  svd(f, u, s, v);
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
  return std::exp(p.hardening * (1 - jp)) * (p.lambda + 2 * p.mu) * stretch2 * p.inverse_density;
}

bool project(const MaterialParams& p, double f[9], double& jp) {
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
