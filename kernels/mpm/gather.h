// SPDX-License-Identifier: MIT
// The moments of grid velocities around each particle: V = sum w v_i and the columns of sum w v_i d^T, d in
// cells. On each axis the three nodes r0 r1 r2 enter as r1 and the differences a = r1 - r0, b = r2 - r1,
// which belong to the cell and are formed once for all of its particles:
//
//   sum w r   = r1 + s,            s = w2 b - w0 a          (the weights add up to 1)
//   sum w d r = d0 s + 2 w2 b,     d0 = -1/2 - f            (d1 = d0 + 1, d2 = d0 + 2, and sum w d = 0)
#pragma once
#include "kernels/mpm/stencil.h"

namespace firn::kernels::FIRN_ISA {

struct AxisWeights {
  alignas(64) float w2[kBatch], minus_w0[kBatch], d0[kBatch];
};
struct GatherWeights {
  alignas(64) std::int32_t offset[kBatch];
  AxisWeights x, y;
  Records4 w_z, wd_z;  // w and w d of the three nodes of a row; 0
};

// v and mass, then the columns of sum w v_i d^T, four floats each.
struct Gathered {
  alignas(64) float of[kBatch][16];
};

FIRN_INLINE void fill_axis(Floats f, int slot, AxisWeights& out) {
  store(out.w2 + slot, weight2(f));
  store(out.minus_w0 + slot, -weight0(f));
  store(out.d0 + slot, splat(-0.5f) - f);
}

FIRN_INLINE void fill_gather_weights(const Place& at, int slot, GatherWeights& out) {
  store(out.offset + slot, at.offset);
  fill_axis(at.x, slot, out.x);
  fill_axis(at.y, slot, out.y);
  const Floats w0 = weight0(at.z), w1 = weight1(at.z), w2 = weight2(at.z), zero = splat(0.f);
  store_records(w0, w1, w2, zero, slot, out.w_z);
  store_records(w0 * (splat(-0.5f) - at.z), w1 * (splat(0.5f) - at.z), w2 * (splat(1.5f) - at.z), zero, slot,
                out.wd_z);
}

// Middle row and differences on an axis.
struct Line {
  Floats middle, a, b;
};
FIRN_INLINE Line line_of(Floats r0, Floats r1, Floats r2) { return {r1, r1 - r0, r2 - r1}; }

// One part of a cell's nine rows, differenced on x, then on y.
struct CellRows {
  Line middle, a, b;  // on x; their members on y
};

FIRN_INLINE CellRows load_cell(const float* at) {
  Line x[3];
#pragma GCC unroll 3
  for (int j = 0; j < 3; ++j) {
    const float* row = at + j * kRowStride;
    x[j] = line_of(load(row), load(row + kSlabStride), load(row + 2 * kSlabStride));
  }
  return {line_of(x[0].middle, x[1].middle, x[2].middle), line_of(x[0].a, x[1].a, x[2].a),
          line_of(x[0].b, x[1].b, x[2].b)};
}

// A part of the sums over a row's nodes: v, then the columns for x, y and z, one entry a z-node.
struct RowSums {
  Floats v, x, y, z;
};

struct Moments {
  Floats sum, first;  // sum w r, sum w d r
};
FIRN_INLINE Moments moments(Floats middle, Floats a, Floats b, const AxisWeights& w, int l) {
  const Floats p = b * splat(w.w2[l]);
  const Floats s = fma(a, splat(w.minus_w0[l]), p);
  return {middle + s, fma(s, splat(w.d0[l]), p + p)};
}

FIRN_INLINE RowSums gather_part(int part, const CellRows& c, const GatherWeights& w, int l) {
  const Moments b = moments(c.middle.b, c.a.b, c.b.b, w.x, l);
  const Moments a = moments(c.middle.a, c.a.a, c.b.a, w.x, l);
  const Moments m = moments(c.middle.middle, c.a.middle, c.b.middle, w.x, l);
  const Moments y = moments(m.sum, a.sum, b.sum, w.y, l);
  const Floats x = fma(a.first, splat(w.y.minus_w0[l]), fma(b.first, splat(w.y.w2[l]), m.first));
  const Floats wz = load_spread4(w.w_z[l], part);
  return {y.sum * wz, x * wz, y.first * wz, y.sum * load_spread4(w.wd_z[l], part)};
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

// All particles of a run, part by part: only one part of the cell's rows fits into the registers.
FIRN_INLINE void gather_run(const GatherWeights& w, int first, int last, const float* tile, Gathered& out) {
  RowSums sums[kBatch][kParts];
#pragma GCC unroll 4
  for (int part = 0; part < kParts; ++part) {
    const CellRows cell = load_cell(tile + w.offset[first] + part * kLanes);
    for (int l = first; l < last; ++l) {
      sums[l][part] = gather_part(part, cell, w, l);
      if (part == kParts - 1) store_node_sums(sums[l], out.of[l]);
    }
  }
}

FIRN_INLINE void gather(const GatherWeights& w, int count, const float* tile, Gathered& out) {
  for (int first = 0; first < count;) {
    const int last = end_of_run(w.offset, first, count);
    gather_run(w, first, last, tile, out);
    first = last;
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
