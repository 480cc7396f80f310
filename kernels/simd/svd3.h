// SPDX-License-Identifier: MIT
// F = U diag(s) V^T in lanes, U and V rotations (det +1), s0 >= s1 >= |s2|; s2 < 0 where det F < 0.
// One-sided Jacobi (Hestenes 1958): rotate pairs of columns of A = F V until they are orthogonal. Working on
// the columns and not on F^T F keeps the small singular values of ill-conditioned F. U comes from
// Gram-Schmidt on A and a cross product, so it is a rotation also at rank 0 to 2, where A does not say what U
// is.
#pragma once
#include "kernels/simd/mat3.h"

namespace firn::kernels::FIRN_ISA {

struct Svd3 {
  Vec3 u[3];  // columns of U
  Floats s[3];
  Vec3 v[3];  // columns of V
};

// Sweeps before V is made a rotation again, and after: the first ones turn by large angles and leave it 1e-6
// off, the last ones turn by next to nothing.
inline constexpr int kLargeSweeps = 3;
inline constexpr int kSmallSweeps = 2;

// Makes a and b orthogonal by the smaller of the two rotations in their plane and turns v, w along.
FIRN_INLINE void jacobi_rotate(Vec3& a, Vec3& b, Vec3& v, Vec3& w) {
  const Floats gamma = dot(a, b);
  const Floats delta = dot(b, b) - dot(a, a);
  const Floats root = sqrt(fma(delta, delta, splat(4.f) * gamma * gamma));
  const Floats t = (gamma + gamma) / (delta + copy_sign(root + splat(1e-30f), delta));
  const Floats c = splat(1.f) / sqrt(fma(t, t, splat(1.f)));
  const Floats s = t * c;
  const Vec3 a0 = a, v0 = v;
  a = add_scaled(a0 * c, b, -s);
  b = add_scaled(b * c, a0, s);
  v = add_scaled(v0 * c, w, -s);
  w = add_scaled(w * c, v0, s);
}

template <int kSweeps>
FIRN_INLINE void jacobi_sweeps(Vec3& a0, Vec3& a1, Vec3& a2, Vec3& v0, Vec3& v1, Vec3& v2) {
#pragma GCC unroll 1
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    jacobi_rotate(a0, a1, v0, v1);
    jacobi_rotate(a0, a2, v0, v2);
    jacobi_rotate(a1, a2, v1, v2);
  }
}

// The matrix with columns f0, f1, f2 times v.
FIRN_INLINE Vec3 combine(const Vec3& f0, const Vec3& f1, const Vec3& f2, const Vec3& v) {
  return add_scaled(add_scaled(f0 * v.x, f1, v.y), f2, v.z);
}

// V becomes a rotation again (each turn leaves it 1e-7 off) and A = F V is formed anew.
FIRN_INLINE void rectify(const Vec3& f0, const Vec3& f1, const Vec3& f2, Vec3& a0, Vec3& a1, Vec3& a2,
                         Vec3& v0, Vec3& v1, Vec3& v2) {
  const Floats one = splat(1.f);
  v0 = v0 * (one / sqrt(dot(v0, v0)));
  v1 = add_scaled(v1, v0, -dot(v1, v0));
  v1 = v1 * (one / sqrt(dot(v1, v1)));
  v2 = cross(v0, v1);
  a0 = combine(f0, f1, f2, v0);
  a1 = combine(f0, f1, f2, v1);
  a2 = combine(f0, f1, f2, v2);
}

// Orders two columns by length; one of the swapped ones changes sign so that the determinants stay.
FIRN_INLINE void longer_first(Vec3& a, Vec3& b, Vec3& v, Vec3& w) {
  const Mask swap = less(dot(a, a), dot(b, b));
  const Vec3 a0 = a, v0 = v;
  a = select(swap, b, a);
  b = select(swap, a0 * splat(-1.f), b);
  v = select(swap, w, v);
  w = select(swap, v0 * splat(-1.f), w);
}

// A power of two near the largest entry, as its reciprocal: scaling by it is exact and keeps squares in
// range.
FIRN_INLINE Floats inverse_scale(const Mat3& f) {
  Floats largest = abs(f.m[0]);
#pragma GCC unroll 8
  for (int i = 1; i < 9; ++i) largest = max(largest, abs(f.m[i]));
  largest = min(max(largest, splat(0x1p-120f)), splat(0x1p120f));
  const Ints exponent = ((Ints)largest >> 23) & 0xff;
  return (Floats)((254 - exponent) << 23);
}

inline void svd3(const Mat3& f, Svd3& out) {
  const Floats shrink = inverse_scale(f);
  const Floats zero = splat(0.f), one = splat(1.f);
  const Vec3 f0 = column(f, 0) * shrink, f1 = column(f, 1) * shrink, f2 = column(f, 2) * shrink;
  Vec3 a0 = f0, a1 = f1, a2 = f2;
  Vec3 v0{one, zero, zero}, v1{zero, one, zero}, v2{zero, zero, one};
  jacobi_sweeps<kLargeSweeps>(a0, a1, a2, v0, v1, v2);
  rectify(f0, f1, f2, a0, a1, a2, v0, v1, v2);
  jacobi_sweeps<kSmallSweeps>(a0, a1, a2, v0, v1, v2);
  rectify(f0, f1, f2, a0, a1, a2, v0, v1, v2);
  longer_first(a0, a1, v0, v1);
  longer_first(a0, a2, v0, v2);
  longer_first(a1, a2, v1, v2);

  const Floats tiny = splat(1e-30f);
  const Floats n0 = sqrt(dot(a0, a0));
  const Mask zero_rank = less_equal(n0, tiny);
  const Vec3 u0 = select(zero_rank, Vec3{one, zero, zero}, a0 * (one / max(n0, tiny)));
  const Vec3 rest = add_scaled(a1, u0, -dot(a1, u0));
  const Floats n1 = sqrt(dot(rest, rest));
  const Mask rank_one = less_equal(n1, n0 * splat(1e-7f));
  const Mask near_x = less(splat(0.6f), abs(u0.x));
  const Vec3 aside = cross(u0, select(near_x, Vec3{zero, one, zero}, Vec3{one, zero, zero}));
  const Vec3 chosen = select(rank_one, aside, rest);
  const Vec3 u1 = chosen * (one / max(sqrt(dot(chosen, chosen)), tiny));
  const Vec3 u2 = cross(u0, u1);

  const Floats grow = one / shrink;
  out = {{u0, u1, u2}, {n0 * grow, dot(a1, u1) * grow, dot(a2, u2) * grow}, {v0, v1, v2}};
}

// U diag(s) V^T
FIRN_INLINE Mat3 compose(const Svd3& d, const Floats (&s)[3]) {
  Mat3 out;
  const Vec3 a = d.u[0] * s[0], b = d.u[1] * s[1], c = d.u[2] * s[2];
  const Floats ar[3] = {a.x, a.y, a.z}, br[3] = {b.x, b.y, b.z}, cr[3] = {c.x, c.y, c.z};
#pragma GCC unroll 3
  for (int r = 0; r < 3; ++r) {
    const Vec3 row = add_scaled(add_scaled(d.v[0] * ar[r], d.v[1], br[r]), d.v[2], cr[r]);
    out.m[3 * r] = row.x;
    out.m[3 * r + 1] = row.y;
    out.m[3 * r + 2] = row.z;
  }
  return out;
}

}  // namespace firn::kernels::FIRN_ISA
