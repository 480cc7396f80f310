// SPDX-License-Identifier: MIT
// The moments of grid velocities around each particle: v = sum w v_i and the columns of C = 4/dx^2 sum w v_i
// (x_i - x_p)^T (Jiang et al. 2015). On one axis, with the nodes r0 r1 r2 and a particle at f in its cell,
// the quadratic B-spline makes both polynomials in f (d in cells):
//
//   2 sum w r     = s + 2 f a + f^2 q              s = r0 + r1,  a = r1 - r0,  q = r2 - 2 r1 + r0
//   4 sum w d r   = a + f^2 (3 - 2 f) q
//
// s, a and q belong to the cell and are formed once for all of its particles that follow one another.
#pragma once
#include "kernels/mpm/stencil.h"

namespace firn::kernels::FIRN_ISA {

struct AxisPowers {
  alignas(64) float twice_f[kBatch], f2[kBatch], smooth[kBatch];  // 2 f, f^2, f^2 (3 - 2 f)
};
struct GatherWeights {
  alignas(64) std::int32_t offset[kBatch];
  AxisPowers x, y;
  Records4 w_z, wd_z;  // w / 4 and w d / 2 of the three nodes of a row; 0
};

// v and mass, then the columns of dx C / 2, four floats each.
struct Gathered {
  alignas(64) float of[kBatch][16];
};
inline constexpr float kGatheredC = 2.f;

FIRN_INLINE void fill_axis(Floats f, int slot, AxisPowers& out) {
  const Floats twice = f + f, f2 = f * f;
  store(out.twice_f + slot, twice);
  store(out.f2 + slot, f2);
  store(out.smooth + slot, f2 * (splat(3.f) - twice));
}

FIRN_INLINE void fill_gather_weights(const Place& at, int slot, GatherWeights& out) {
  store(out.offset + slot, at.offset);
  fill_axis(at.x, slot, out.x);
  fill_axis(at.y, slot, out.y);
  const Floats half = splat(0.5f), zero = splat(0.f);
  const Floats w0 = weight0(at.z) * half, w1 = weight1(at.z) * half, w2 = weight2(at.z) * half;
  store_records(w0 * half, w1 * half, w2 * half, zero, slot, out.w_z);
  store_records(w0 * (-half - at.z), w1 * (half - at.z), w2 * (splat(1.5f) - at.z), zero, slot, out.wd_z);
}

// s, a and q of three nodes on an axis.
struct Line {
  Floats s, a, q;
};
FIRN_INLINE Line line_of(Floats r0, Floats r1, Floats r2) {
  const Floats a = r1 - r0;
  return {r0 + r1, a, (r2 - r1) - a};
}

// One part of a cell's nine rows: lines on x, then on y.
struct CellRows {
  Line s, a, q;  // on x; their members on y
};
FIRN_INLINE CellRows load_cell(const float* at) {
  Line x[3];
#pragma GCC unroll 3
  for (int j = 0; j < 3; ++j) {
    const float* row = at + j * kRowStride;
    x[j] = line_of(load(row), load(row + kSlabStride), load(row + 2 * kSlabStride));
  }
  return {line_of(x[0].s, x[1].s, x[2].s), line_of(x[0].a, x[1].a, x[2].a), line_of(x[0].q, x[1].q, x[2].q)};
}

// At one particle of the cell.
struct Powers {
  Floats twice_f, f2, smooth;
};
FIRN_INLINE Powers powers_of(const AxisPowers& p, int l) {
  return {splat(p.twice_f[l]), splat(p.f2[l]), splat(p.smooth[l])};
}
FIRN_INLINE Floats value(Floats s, Floats a, Floats q, const Powers& p) {
  return fma(q, p.f2, fma(a, p.twice_f, s));
}
FIRN_INLINE Floats slope(Floats a, Floats q, const Powers& p) { return fma(q, p.smooth, a); }

// A part of the sums over a row's nodes: v, then the columns for x, y and z, one entry a z-node.
struct RowSums {
  Floats v, x, y, z;
};

FIRN_INLINE RowSums gather_part(int part, const CellRows& c, const GatherWeights& w, int l) {
  const Powers x = powers_of(w.x, l), y = powers_of(w.y, l);
  const Floats s = value(c.s.s, c.a.s, c.q.s, x), a = value(c.s.a, c.a.a, c.q.a, x),
               q = value(c.s.q, c.a.q, c.q.q, x);
  const Floats in_x = value(slope(c.a.s, c.q.s, x), slope(c.a.a, c.q.a, x), slope(c.a.q, c.q.q, x), y);
  const Floats v = value(s, a, q, y), wz = load_spread4(w.w_z[l], part);
  return {v * wz, in_x * wz, slope(a, q, y) * wz, v * load_spread4(w.wd_z[l], part)};
}

// Sums of a row's four nodes, as (0 + 2) + (1 + 3) at every width.
FIRN_INLINE void store_node_sums(const RowSums (&s)[kParts], float* out) {
#if defined(__AVX512F__)
  // Each step adds two halves of two sums at once: lanes that stay by a blend, the others by one shuffle.
  const auto halves = [](__m512 a, __m512 b) FIRN_INLINE_LAMBDA {
    return _mm512_add_ps(_mm512_mask_blend_ps(0xff00, a, b), _mm512_shuffle_f32x4(a, b, 0x4e));
  };
  const __m512 vy = halves(s[0].v, s[0].y), xz = halves(s[0].x, s[0].z);
  const __m512i odd = _mm512_setr_epi32(4, 5, 6, 7, 16, 17, 18, 19, 12, 13, 14, 15, 24, 25, 26, 27);
  store(out, _mm512_add_ps(_mm512_mask_blend_ps(0xf0f0, vy, xz), _mm512_permutex2var_ps(vy, odd, xz)));
#elif defined(__AVX2__)
  const __m256 v = s[0].v + s[1].v, x = s[0].x + s[1].x, y = s[0].y + s[1].y, z = s[0].z + s[1].z;
  store(out, _mm256_add_ps(_mm256_permute2f128_ps(v, x, 0x20), _mm256_permute2f128_ps(v, x, 0x31)));
  store(out + 8, _mm256_add_ps(_mm256_permute2f128_ps(y, z, 0x20), _mm256_permute2f128_ps(y, z, 0x31)));
#else
  store(out, (s[0].v + s[2].v) + (s[1].v + s[3].v));
  store(out + 4, (s[0].x + s[2].x) + (s[1].x + s[3].x));
  store(out + 8, (s[0].y + s[2].y) + (s[1].y + s[3].y));
  store(out + 12, (s[0].z + s[2].z) + (s[1].z + s[3].z));
#endif
}

// Part by part: only one part of a cell's rows fits into the registers.
FIRN_INLINE void gather(const GatherWeights& w, int count, const float* tile, Gathered& out) {
  RowSums sums[kBatch][kParts];
#pragma GCC unroll 4
  for (int part = 0; part < kParts; ++part) {
    CellRows cell = load_cell(tile + w.offset[0] + part * kLanes);
    for (int l = 0; l < count; ++l) {
      if (l > 0 && w.offset[l] != w.offset[l - 1]) cell = load_cell(tile + w.offset[l] + part * kLanes);
      sums[l][part] = gather_part(part, cell, w, l);
      if (part == kParts - 1) store_node_sums(sums[l], out.of[l]);
    }
  }
}

// Inert lanes stand still.
FIRN_INLINE void clear_from(int count, Gathered& out) {
  for (int l = count; l < kBatch; ++l) {
    for (float& of : out.of[l]) of = 0;
  }
}

FIRN_INLINE void load_gathered(const Gathered& g, int slot, float c_scale, Vec3& v, Mat3& c) {
  Floats r[16];
#pragma GCC unroll 4
  for (int part = 0; part < kParts; ++part) {
#pragma GCC unroll 16
    for (int l = 0; l < kLanes; ++l) r[part * kLanes + l] = load(g.of[slot + l] + part * kLanes);
    transpose(r + part * kLanes);
  }
  v = {r[0], r[1], r[2]};
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) c.m[i] = r[4 * (i % 3 + 1) + i / 3] * splat(c_scale);
}

}  // namespace firn::kernels::FIRN_ISA
