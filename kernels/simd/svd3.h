// SPDX-License-Identifier: MIT
// F = U diag(s) V^T in lanes, U and V rotations (det +1), s0 >= s1 >= |s2| to round-off; s2 < 0 where det F <
// 0. No iteration: of the three eigenvalues of F^T F, the one that stands farthest from the others is a well-
// conditioned root of the characteristic polynomial and has a well-conditioned eigenvector, at multiple
// eigenvalues too. In the plane across it one Jacobi rotation of the columns of F V is left (Hestenes 1958);
// working on the columns and not on F^T F there keeps the small singular values of ill-conditioned F. U comes
// from Gram-Schmidt on F V and a cross product, so it is a rotation also at rank 0 to 2, where F V does not
// say what U is.
#pragma once
#include "kernels/simd/mat3.h"

namespace firn::kernels::FIRN_ISA {

struct Svd3 {
  Vec3 u[3];  // columns of U
  Floats s[3];
  Vec3 v[3];  // columns of V
};

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

// Reciprocal of a power of two between 2^-126 and 2^126.
FIRN_INLINE Floats reciprocal_of_power(Floats power) { return (Floats)((254 << 23) - (Ints)power); }

FIRN_INLINE Floats inverse_root(Floats a) { return splat(1.f) / sqrt(a); }

// 2 cos(arccos(r) / 3) for r in [0, 1], to 1e-7: the largest root of x^3 - 3 x = 2 r.
FIRN_INLINE Floats largest_root(Floats r) {
  constexpr float kC[9] = {1.73205078f,  0.333332807f,    -0.0962100402f, 0.0492176637f,   -0.0302495267f,
                           0.018840149f, -0.00994513649f, 0.0035819211f,  -0.000618640392f};
  Floats root = splat(kC[8]);
#pragma GCC unroll 8
  for (int i = 7; i >= 0; --i) root = fma(root, r, splat(kC[i]));
  return root;
}

// Unit eigenvector of S for the eigenvalue farthest from the other two; `largest` where it is above them.
struct FarEigenvector {
  Vec3 v;
  Mask largest;
};

// With B = (S - q I) / p, tr B = 0 and |B|^2 = 6, that eigenvalue is +-2 cos phi, 3 phi = arccos |det B / 2|;
// the others are 1.7 or more away from it. adj(B - lambda I) is a multiple, 6 or more, of v v^T. Where S = q
// I any vector does.
FIRN_INLINE FarEigenvector far_eigenvector(const Sym3& s) {
  const Floats q = trace(s) * splat(1.f / 3), xx = s.xx - q, yy = s.yy - q;
  const Sym3 deviator{xx, yy, -(xx + yy), s.xy, s.xz, s.yz};
  const Sym3 b = deviator * inverse_root(max(norm2(deviator) * splat(1.f / 6), splat(1e-30f)));
  const Floats half = determinant(b) * splat(0.5f);
  const Floats lambda = copy_sign(largest_root(min(abs(half), splat(1.f))), half);
  const Sym3 m = add_diagonal(b, -lambda);
  const Sym3 adj = adjugate(m);
  const Mask by_y = less(adj.xx, adj.yy);
  const Vec3 xy = select(by_y, Vec3{adj.xy, adj.yy, adj.yz}, Vec3{adj.xx, adj.xy, adj.xz});
  const Vec3 along = select(less(max(adj.xx, adj.yy), adj.zz), Vec3{adj.xz, adj.yz, adj.zz}, xy);
  return {along * inverse_root(dot(along, along)), less(splat(0.f), lambda)};
}

// Two unit vectors a, b that make (a, b, v) a rotation (Duff et al. 2017).
FIRN_INLINE void complete_frame(const Vec3& v, Vec3& a, Vec3& b) {
  const Floats one = splat(1.f), sign = copy_sign(one, v.z);
  const Floats h = -one / (sign + v.z), xy = v.x * v.y * h;
  a = {fma(sign * v.x * v.x, h, one), sign * xy, -(sign * v.x)};
  b = {xy, fma(v.y * v.y, h, sign), -v.y};
}

// Turns a and b in their plane until they are orthogonal and a is the longer one, and v and w along.
FIRN_INLINE void jacobi_rotate(Vec3& a, Vec3& b, Vec3& v, Vec3& w) {
  // tan of twice the angle = y / delta; (x, y) points along the smaller of the two angles.
  const Floats gamma = dot(a, b), delta = dot(a, a) - dot(b, b), y = gamma + gamma;
  const Floats x = max(sqrt(fma(delta, delta, y * y)) + abs(delta), splat(1e-18f));
  const Floats inverse = inverse_root(fma(x, x, y * y));
  const Mask swap = less(delta, splat(0.f));
  const Floats c = select(swap, abs(y), x) * inverse, s = copy_sign(select(swap, x, abs(y)) * inverse, y);
  const Vec3 a0 = a, v0 = v;
  a = add_scaled(a0 * c, b, s);
  b = add_scaled(b * c, a0, -s);
  v = add_scaled(v0 * c, w, s);
  w = add_scaled(w * c, v0, -s);
}

// The matrix with columns f0, f1, f2 times v.
FIRN_INLINE Vec3 combine(const Vec3& f0, const Vec3& f1, const Vec3& f2, const Vec3& v) {
  return add_scaled(add_scaled(f0 * v.x, f1, v.y), f2, v.z);
}

inline void svd3(const Mat3& f, Svd3& out) {
  const Floats shrink = inverse_scale(f), grow = reciprocal_of_power(shrink);
  const Vec3 f0 = column(f, 0) * shrink, f1 = column(f, 1) * shrink, f2 = column(f, 2) * shrink;
  const Sym3 s{dot(f0, f0), dot(f1, f1), dot(f2, f2), dot(f0, f1), dot(f0, f2), dot(f1, f2)};
  const FarEigenvector far = far_eigenvector(s);
  Vec3 w0, w1;
  complete_frame(far.v, w0, w1);
  Vec3 b0 = combine(f0, f1, f2, w0), b1 = combine(f0, f1, f2, w1);
  const Vec3 along = combine(f0, f1, f2, far.v);
  jacobi_rotate(b0, b1, w0, w1);
  // (w0, w1, v) and (v, w0, w1) are rotations alike.
  const Vec3 a0 = select(far.largest, along, b0), a1 = select(far.largest, b0, b1),
             a2 = select(far.largest, b1, along);

  const Floats zero = splat(0.f), one = splat(1.f), tiny = splat(1e-30f);
  const Floats n0 = sqrt(dot(a0, a0));
  const Mask zero_rank = less_equal(n0, tiny);
  const Vec3 u0 = select(zero_rank, Vec3{one, zero, zero}, a0 * (one / max(n0, tiny)));
  const Vec3 rest = add_scaled(a1, u0, -dot(a1, u0));
  const Mask rank_one = less_equal(dot(rest, rest), n0 * n0 * splat(1e-14f));
  const Mask near_x = less(splat(0.6f), abs(u0.x));
  const Vec3 aside = cross(u0, select(near_x, Vec3{zero, one, zero}, Vec3{one, zero, zero}));
  const Vec3 chosen = select(rank_one, aside, rest);
  const Vec3 near_u1 = chosen * inverse_root(dot(chosen, chosen));
  const Vec3 u1 = add_scaled(near_u1, u0, -dot(near_u1, u0));  // again, for a short rest
  const Vec3 u2 = cross(u0, u1);

  out = {{u0, u1, u2},
         {n0 * grow, dot(a1, u1) * grow, dot(a2, u2) * grow},
         {select(far.largest, far.v, w0), select(far.largest, w0, w1), select(far.largest, w1, far.v)}};
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
