// SPDX-License-Identifier: MIT
// Snow of the baseline, one particle at a time: F = U diag(s) V^T by scalar Jacobi rotations, the singular
// values clamped, and Stomakhin's fixed-corotated stress from what is left (docs/physics.md has the
// equations). Matrices are row-major.
#pragma once
#include <algorithm>
#include <cmath>

namespace firn::bench {

struct NaiveSnow {
  float mu, lambda;            // Pa
  float hardening;             // xi
  float sigma_min, sigma_max;  // bounds of the singular values of F
  float jp_min, jp_max;
};

struct NaiveSvd {
  float u[9], s[3], v[9];  // columns of u and v belong to s
};

// Turns columns p and q of the symmetric matrix a, and of v, so that a[p][q] vanishes.
inline void jacobi_rotate(float a[9], float v[9], int p, int q) {
  const float apq = a[3 * p + q];
  if (apq == 0) return;
  const float theta = (a[3 * q + q] - a[3 * p + p]) / (2 * apq);
  const float t = std::copysign(1.f, theta) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
  const float c = 1 / std::sqrt(t * t + 1), s = t * c;
  const int r = 3 - p - q;
  const float arp = a[3 * r + p], arq = a[3 * r + q];
  a[3 * p + p] -= t * apq;
  a[3 * q + q] += t * apq;
  a[3 * p + q] = a[3 * q + p] = 0;
  a[3 * r + p] = a[3 * p + r] = c * arp - s * arq;
  a[3 * r + q] = a[3 * q + r] = s * arp + c * arq;
  for (int k = 0; k < 3; ++k) {
    const float vp = v[3 * k + p], vq = v[3 * k + q];
    v[3 * k + p] = c * vp - s * vq;
    v[3 * k + q] = s * vp + c * vq;
  }
}

// V diagonalises F^T F, s are the lengths of the columns of F V, U their directions. Five sweeps bring any
// matrix to round-off; `stop_early` asks before each whether it is there, which near the identity saves most.
inline NaiveSvd naive_svd(const float f[9], bool stop_early) {
  NaiveSvd out{{}, {}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  float a[9];
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) a[3 * r + c] = f[r] * f[c] + f[3 + r] * f[3 + c] + f[6 + r] * f[6 + c];
  }
  const float small = 1e-7f * (a[0] + a[4] + a[8]);
  for (int sweep = 0; sweep < 5; ++sweep) {
    if (stop_early && a[1] * a[1] + a[2] * a[2] + a[5] * a[5] < small * small) break;
    jacobi_rotate(a, out.v, 0, 1);
    jacobi_rotate(a, out.v, 0, 2);
    jacobi_rotate(a, out.v, 1, 2);
  }
  int least = 0;
  for (int c = 0; c < 3; ++c) {
    float fv[3];
    for (int r = 0; r < 3; ++r)
      fv[r] = f[3 * r] * out.v[c] + f[3 * r + 1] * out.v[3 + c] + f[3 * r + 2] * out.v[6 + c];
    out.s[c] = std::sqrt(fv[0] * fv[0] + fv[1] * fv[1] + fv[2] * fv[2]);
    for (int r = 0; r < 3; ++r) out.u[3 * r + c] = fv[r] / std::max(out.s[c], 1e-30f);
    if (out.s[c] < out.s[least]) least = c;
  }
  const float det = f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) +
                    f[2] * (f[3] * f[7] - f[4] * f[6]);
  if (det < 0) {  // inverted: the smallest value is the negative one, and U a rotation
    out.s[least] = -out.s[least];
    for (int r = 0; r < 3; ++r) out.u[3 * r + least] = -out.u[3 * r + least];
  }
  return out;
}

// Clamps F, moves the lost volume change into Jp and writes the Kirchhoff stress; true when F changed.
inline bool naive_yield(const NaiveSnow& snow, bool stop_early, float f[9], float& jp, float tau[9]) {
  NaiveSvd d = naive_svd(f, stop_early);
  bool changed = false;
  float before = 1, after = 1;
  for (float& s : d.s) {
    const float inside = std::clamp(s, snow.sigma_min, snow.sigma_max);
    changed = changed || inside != s;
    before *= s;
    after *= inside;
    s = inside;
  }
  if (changed) {
    jp = std::clamp(jp * before / after, snow.jp_min, snow.jp_max);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        f[3 * r + c] = 0;
        for (int k = 0; k < 3; ++k) f[3 * r + c] += d.u[3 * r + k] * d.s[k] * d.v[3 * c + k];
      }
    }
  }
  // tau = 2 mu (F - R) F^T + lambda (J - 1) J I, diagonal in the frame of U
  const float h = std::exp(snow.hardening * (1 - jp));
  float along[3];
  for (int k = 0; k < 3; ++k) {
    along[k] = h * (2 * snow.mu * (d.s[k] - 1) * d.s[k] + snow.lambda * (after - 1) * after);
  }
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      tau[3 * r + c] = 0;
      for (int k = 0; k < 3; ++k) tau[3 * r + c] += d.u[3 * r + k] * along[k] * d.u[3 * c + k];
    }
  }
  return changed;
}

}  // namespace firn::bench
