// SPDX-License-Identifier: MIT
// Eigenvalues of a symmetric 3x3 matrix in lanes, ascending, in closed form and to round-off of the largest
// (measured: 5e-7, on random, double, triple and scaled spectra).
//
// With q = tr A / 3 and B = A - q I the eigenvalues are q + 2 p cos(phi + 2 pi k / 3), where 3 phi is the
// angle between B and the deviator W of B^2 as vectors with the Frobenius product. The textbook's arc cosine
// of det B loses half of the digits where two eigenvalues meet. The sine of the angle, |B ^ W|, is a sum of
// squares of 2x2 minors (Lagrange's identity) and keeps them.
#pragma once
#include "kernels/simd/mat3.h"

namespace firn::kernels::FIRN_ISA {

// A traceless symmetric matrix as a vector of five: squared length = half of the squared Frobenius norm.
struct Deviator {
  Floats of[5];  // (xx - yy) / 2, zz sqrt(3)/2, xy, xz, yz
};

FIRN_INLINE Floats dot(const Deviator& a, const Deviator& b) {
  const Floats diagonal = fma(a.of[0], b.of[0], a.of[1] * b.of[1]);
  return fma(a.of[2], b.of[2], diagonal) + fma(a.of[3], b.of[3], a.of[4] * b.of[4]);
}

// |a ^ b|^2
FIRN_INLINE Floats wedge2(const Deviator& a, const Deviator& b) {
  Floats sum[2] = {splat(0.f), splat(0.f)};
#pragma GCC unroll 5
  for (int i = 0; i < 5; ++i) {
#pragma GCC unroll 5
    for (int j = i + 1; j < 5; ++j) {
      const Floats minor = fma(a.of[i], b.of[j], -(a.of[j] * b.of[i]));
      sum[(i + j) % 2] = fma(minor, minor, sum[(i + j) % 2]);
    }
  }
  return sum[0] + sum[1];
}

// Deviator of the square of a B of unit length.
FIRN_INLINE Deviator deviator_of_square(const Deviator& b) {
  const Floats u = b.of[0], zz = b.of[1] * splat(1.15470054f), xy = b.of[2], xz = b.of[3], yz = b.of[4];
  const Floats half = splat(0.5f), xx = fma(-half, zz, u), yy = fma(-half, zz, -u);
  const Floats xz2 = xz * xz, yz2 = yz * yz;
  return {fma(half, xz2 - yz2, -(zz * u)), fma(zz, zz, (xz2 + yz2) - splat(2.f / 3)) * splat(0.866025404f),
          fma(xz, yz, -(xy * zz)), fma(xy, yz, -(xz * yy)), fma(xy, xz, -(yz * xx))};
}

template <int n>
FIRN_INLINE Floats polynomial(const float (&c)[n], Floats x) {
  Floats p = splat(c[n - 1]);
#pragma GCC unroll 16
  for (int i = n - 2; i >= 0; --i) p = fma(p, x, splat(c[i]));
  return p;
}

// With t = tan(3 phi / 2) in [0, 1]: cos phi and sqrt(3) sin phi / t as polynomials in t^2, to 4e-8.
inline constexpr float kCosine[9] = {1.f,           -0.222219274f,  0.156295285f,
                                     -0.1237517f,   0.100140862f,   -0.0743625313f,
                                     0.0436556935f, -0.0167306885f, 0.00299778977f};
inline constexpr float kSine[9] = {1.15470052f,   -0.47042793f,  0.318215281f,   -0.246213585f, 0.196303576f,
                                   -0.144418433f, 0.0843154117f, -0.0322097912f, 0.00576038752f};

FIRN_INLINE void eigenvalues3(const Sym3& a, Floats (&out)[3]) {
  const Floats q = trace(a) * splat(1.f / 3), root3 = splat(1.73205081f);
  Deviator b{(a.xx - a.yy) * splat(0.5f), (a.zz - q) * splat(0.866025404f), a.xy, a.xz, a.yz};
  const Floats length = sqrt(dot(b, b));
  const Floats inverse = splat(1.f) / max(length, splat(1e-30f));
#pragma GCC unroll 5
  for (int i = 0; i < 5; ++i) b.of[i] = b.of[i] * inverse;
  const Deviator w = deviator_of_square(b);
  // Of B and -B, the one whose angle is at most pi/2.
  const Floats cosine = dot(b, w) * root3, sine = sqrt(wedge2(b, w)) * root3;
  const Floats t = sine / (splat(1.f) + abs(cosine)), t2 = t * t;
  const Floats c = polynomial(kCosine, t2), s = t * polynomial(kSine, t2);
  const Floats p = copy_sign(length * splat(0.577350269f), cosine);
  const Floats outer = fma(-p, c + s, q), other = fma(p, c + c, q);
  out[0] = min(outer, other);
  out[1] = fma(-p, c - s, q);
  out[2] = max(outer, other);
}

}  // namespace firn::kernels::FIRN_ISA
