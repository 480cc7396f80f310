// SPDX-License-Identifier: MIT
// 3x3 matrices in lanes, one matrix a lane: full (row-major) and symmetric.
#pragma once
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

struct Vec3 {
  Floats x, y, z;
};
struct Mat3 {
  Floats m[9];  // m[3 * row + column]
};
struct Sym3 {
  Floats xx, yy, zz, xy, xz, yz;
};

FIRN_INLINE Vec3 operator*(Vec3 a, Floats s) { return {a.x * s, a.y * s, a.z * s}; }
FIRN_INLINE Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
FIRN_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
FIRN_INLINE Floats dot(const Vec3& a, const Vec3& b) { return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z)); }
FIRN_INLINE Vec3 cross(const Vec3& a, const Vec3& b) {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}
// a + b s
FIRN_INLINE Vec3 add_scaled(const Vec3& a, const Vec3& b, Floats s) {
  return {fma(b.x, s, a.x), fma(b.y, s, a.y), fma(b.z, s, a.z)};
}
FIRN_INLINE Vec3 select(Mask m, const Vec3& yes, const Vec3& no) {
  return {select(m, yes.x, no.x), select(m, yes.y, no.y), select(m, yes.z, no.z)};
}

FIRN_INLINE Vec3 row(const Mat3& a, int r) { return {a.m[3 * r], a.m[3 * r + 1], a.m[3 * r + 2]}; }
FIRN_INLINE Vec3 column(const Mat3& a, int c) { return {a.m[c], a.m[3 + c], a.m[6 + c]}; }

// A copy, entry by entry, for a call that is not inlined: `a` itself can then stay in registers.
FIRN_INLINE Mat3 in_memory(const Mat3& a) {
  Mat3 out;
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) out.m[i] = a.m[i];
  return out;
}

FIRN_INLINE Mat3 select(Mask mask, const Mat3& yes, const Mat3& no) {
  Mat3 out;
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) out.m[i] = select(mask, yes.m[i], no.m[i]);
  return out;
}

FIRN_INLINE Floats det(const Mat3& a) { return dot(row(a, 0), cross(row(a, 1), row(a, 2))); }
FIRN_INLINE Floats norm2(const Mat3& a) {
  return dot(row(a, 0), row(a, 0)) + (dot(row(a, 1), row(a, 1)) + dot(row(a, 2), row(a, 2)));
}

// (I + s A) F
FIRN_INLINE Mat3 advance(const Mat3& a, Floats s, const Mat3& f) {
  Mat3 out;
#pragma GCC unroll 3
  for (int r = 0; r < 3; ++r) {
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) out.m[3 * r + c] = fma(dot(row(a, r), column(f, c)), s, f.m[3 * r + c]);
  }
  return out;
}

// A + S B, S symmetric
FIRN_INLINE Mat3 add_product(const Mat3& a, const Sym3& s, const Mat3& b) {
  const Vec3 rows[3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
  Mat3 out;
#pragma GCC unroll 3
  for (int r = 0; r < 3; ++r) {
#pragma GCC unroll 3
    for (int c = 0; c < 3; ++c) out.m[3 * r + c] = a.m[3 * r + c] + dot(rows[r], column(b, c));
  }
  return out;
}

// S v
FIRN_INLINE Vec3 times(const Sym3& s, const Vec3& v) {
  return {dot({s.xx, s.xy, s.xz}, v), dot({s.xy, s.yy, s.yz}, v), dot({s.xz, s.yz, s.zz}, v)};
}

// A A^T
FIRN_INLINE Sym3 times_transpose(const Mat3& a) {
  const Vec3 x = row(a, 0), y = row(a, 1), z = row(a, 2);
  return {dot(x, x), dot(y, y), dot(z, z), dot(x, y), dot(x, z), dot(y, z)};
}
// A^T A
FIRN_INLINE Sym3 transpose_times(const Mat3& a) {
  const Vec3 x = column(a, 0), y = column(a, 1), z = column(a, 2);
  return {dot(x, x), dot(y, y), dot(z, z), dot(x, y), dot(x, z), dot(y, z)};
}

FIRN_INLINE Sym3 operator*(const Sym3& a, Floats s) {
  return {a.xx * s, a.yy * s, a.zz * s, a.xy * s, a.xz * s, a.yz * s};
}
FIRN_INLINE Sym3 operator-(const Sym3& a, const Sym3& b) {
  return {a.xx - b.xx, a.yy - b.yy, a.zz - b.zz, a.xy - b.xy, a.xz - b.xz, a.yz - b.yz};
}
FIRN_INLINE Sym3 operator+(const Sym3& a, const Sym3& b) {
  return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
}
// A + s B
FIRN_INLINE Sym3 add_scaled(const Sym3& a, const Sym3& b, Floats s) {
  return {fma(b.xx, s, a.xx), fma(b.yy, s, a.yy), fma(b.zz, s, a.zz),
          fma(b.xy, s, a.xy), fma(b.xz, s, a.xz), fma(b.yz, s, a.yz)};
}
FIRN_INLINE Sym3 add_diagonal(const Sym3& a, Floats s) {
  return {a.xx + s, a.yy + s, a.zz + s, a.xy, a.xz, a.yz};
}
// A B of two matrices that commute, so that the product is symmetric.
FIRN_INLINE Sym3 commuting_product(const Sym3& a, const Sym3& b) {
  const Vec3 ax{a.xx, a.xy, a.xz}, ay{a.xy, a.yy, a.yz}, az{a.xz, a.yz, a.zz};
  const Vec3 bx{b.xx, b.xy, b.xz}, by{b.xy, b.yy, b.yz}, bz{b.xz, b.yz, b.zz};
  return {dot(ax, bx), dot(ay, by), dot(az, bz), dot(ax, by), dot(ax, bz), dot(ay, bz)};
}
FIRN_INLINE Floats trace(const Sym3& a) { return a.xx + (a.yy + a.zz); }
FIRN_INLINE Floats norm2(const Sym3& a) {
  const Floats off = fma(a.xy, a.xy, fma(a.xz, a.xz, a.yz * a.yz));
  return fma(a.xx, a.xx, fma(a.yy, a.yy, fma(a.zz, a.zz, off + off)));
}
FIRN_INLINE Sym3 select(Mask m, const Sym3& yes, const Sym3& no) {
  return {select(m, yes.xx, no.xx), select(m, yes.yy, no.yy), select(m, yes.zz, no.zz),
          select(m, yes.xy, no.xy), select(m, yes.xz, no.xz), select(m, yes.yz, no.yz)};
}

FIRN_INLINE Floats determinant(const Sym3& a) {
  const Vec3 x{a.xx, a.xy, a.xz}, y{a.xy, a.yy, a.yz}, z{a.xz, a.yz, a.zz};
  return dot(x, cross(y, z));
}

// A^-1 det A
FIRN_INLINE Sym3 adjugate(const Sym3& a) {
  return {fma(a.yy, a.zz, -(a.yz * a.yz)), fma(a.xx, a.zz, -(a.xz * a.xz)), fma(a.xx, a.yy, -(a.xy * a.xy)),
          fma(a.xz, a.yz, -(a.xy * a.zz)), fma(a.xy, a.yz, -(a.xz * a.yy)), fma(a.xy, a.xz, -(a.yz * a.xx))};
}

// All leading minors positive (Sylvester) by more than their round-off, which is relative to the trace: true
// only for what is positive definite; false for NaN.
FIRN_INLINE Mask surely_positive_definite(const Sym3& a) {
  const Floats t = trace(a), least2 = t * t * splat(2e-7f);
  const Floats minor2 = fma(a.xx, a.yy, -(a.xy * a.xy));
  return less(splat(0.f), a.xx) & less(least2, minor2) & less(least2 * t, determinant(a));
}
FIRN_INLINE Mask surely_negative_definite(const Sym3& a) {
  const Floats t = trace(a), least2 = t * t * splat(2e-7f);
  const Floats minor2 = fma(a.xx, a.yy, -(a.xy * a.xy));
  return less(a.xx, splat(0.f)) & less(least2, minor2) & less(determinant(a), least2 * t);
}

}  // namespace firn::kernels::FIRN_ISA
