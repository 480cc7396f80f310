// SPDX-License-Identifier: MIT
// Tile -> particles: v = sum w v_i, C = 4/dx^2 sum w v_i (x_i - x_p)^T, then x += dt v, F = (I + dt C) F with
// this very C, and plasticity. Gathered with nodes in lanes into one record a particle, transposed, then one
// particle a lane.
#include "kernels/mpm/materials.h"
#include "kernels/mpm/stencil.h"
#include "kernels/mpm/summary.h"

namespace firn::kernels::FIRN_ISA {

namespace {

// v and mass, then the columns of (sum w v_i d^T), d in cells.
struct Gathered {
  alignas(64) float of[kBatch][16];
};

// Sums of a row's four nodes, as (0 + 2) + (1 + 3) at every width: v, then the three columns of the affine
// part.
FIRN_INLINE void store_node_sums(Floats (&sums)[4][16 / kLanes], float* out) {
#if defined(__AVX512F__)
  const __m512 a = sums[0][0], b = sums[1][0], c = sums[2][0], d = sums[3][0];
  const __m512 ab = _mm512_add_ps(_mm512_shuffle_f32x4(a, b, 0x44), _mm512_shuffle_f32x4(a, b, 0xee));
  const __m512 cd = _mm512_add_ps(_mm512_shuffle_f32x4(c, d, 0x44), _mm512_shuffle_f32x4(c, d, 0xee));
  store(out, _mm512_add_ps(_mm512_shuffle_f32x4(ab, cd, 0x88), _mm512_shuffle_f32x4(ab, cd, 0xdd)));
#elif defined(__AVX2__)
  const __m256 a = sums[0][0] + sums[0][1], b = sums[1][0] + sums[1][1];
  const __m256 c = sums[2][0] + sums[2][1], d = sums[3][0] + sums[3][1];
  store(out, _mm256_add_ps(_mm256_permute2f128_ps(a, b, 0x20), _mm256_permute2f128_ps(a, b, 0x31)));
  store(out + 8, _mm256_add_ps(_mm256_permute2f128_ps(c, d, 0x20), _mm256_permute2f128_ps(c, d, 0x31)));
#else
  for (int k = 0; k < 4; ++k) store(out + 4 * k, (sums[k][0] + sums[k][2]) + (sums[k][1] + sums[k][3]));
#endif
}

// Part `part` of the rows of particle l: sums over x and y, still one entry a z-node.
FIRN_INLINE void gather_part(int part, const Stencils& s, int l, const float* tile,
                             Floats (&sums)[4][16 / kLanes]) {
  const float* at = tile + s.offset[l] + part * kLanes;
  const float fx = s.fraction[0][l], fy = s.fraction[1][l];
  const Floats fz = splat(s.fraction[2][l]);
  const Floats wy[3] = {splat(s.wy[0][l]), splat(s.wy[1][l]), splat(s.wy[2][l])};
  Floats v = splat(0.f), by_x = v, by_y = v;
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    Floats line = splat(0.f), line_y = line;
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      const Floats row = load(at + i * kSlabStride + j * kRowStride) * wy[j];
      line = line + row;
      line_y = fma(row, splat(static_cast<float>(j) - 0.5f - fy), line_y);
    }
    const Floats wx = splat(s.wx[i][l]);
    line = line * wx;
    v = v + line;
    by_x = fma(line, splat(static_cast<float>(i) - 0.5f - fx), by_x);
    by_y = fma(line_y, wx, by_y);
  }
  const Floats wz = row_weight(part, fz);
  sums[0][part] = v * wz;
  sums[1][part] = by_x * wz;
  sums[2][part] = by_y * wz;
  sums[3][part] = sums[0][part] * row_distance(part, fz);
}

FIRN_INLINE void gather(const Stencils& s, int count, const float* tile, Gathered& out) {
  for (int l = 0; l < count; ++l) {
    Floats sums[4][16 / kLanes];
#pragma GCC unroll 4
    for (int part = 0; part < 16 / kLanes; ++part) gather_part(part, s, l, tile, sums);
    store_node_sums(sums, out.of[l]);
  }
}

FIRN_INLINE void load_gathered(const Gathered& g, int slot, float c_scale, Vec3& v, Mat3& c) {
  Floats r[16];
#pragma GCC unroll 4
  for (int part = 0; part < 16 / kLanes; ++part) {
#pragma GCC unroll 16
    for (int l = 0; l < kLanes; ++l) r[part * kLanes + l] = load(g.of[slot + l] + part * kLanes);
    transpose(r + part * kLanes);
  }
  v = {r[0], r[1], r[2]};
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) c.m[i] = r[4 * (i % 3 + 1) + i / 3] * splat(c_scale);
}

FIRN_INLINE Ints move(const ParticleView& p, int axis, Batch b, Floats displacement) {
  const Ints x = wrapping_add(load_first(p.x[axis] + b.first, b.count, 0), round_to_int(displacement));
  store_first(p.x[axis] + b.first, b.count, x);
  return x;
}

FIRN_INLINE void update_particles(const StepParams& step, const MaterialParams* materials,
                                  const ParticleView& p, Batch b, int slot, const Gathered& gathered,
                                  Summary& summary) {
  Vec3 v;
  Mat3 c;
  load_gathered(gathered, slot, 4.f * step.inv_dx, v, c);
  store_vec3(p.v, b, v);
  store_mat3(p.C, b, c);
  const Floats to_fixed = splat(step.dt * step.inv_dx * static_cast<float>(kOneCell));
  summary.add_position(move(p, 0, b, v.x * to_fixed), move(p, 1, b, v.y * to_fixed),
                       move(p, 2, b, v.z * to_fixed));

  Mat3 f = advance(c, splat(step.dt), load_mat3(p.F, b, 1.f));
  Floats jp = load(p.Jp, b, 1.f), wave2 = splat(0.f);
  for_each_object(materials, p.object, b,
                  [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                    if (params.plastic) summary.add_clamped(model.project(params, f, jp, mask), b.count);
                    wave2 = select(mask, model.wave_speed2(params, f, jp), wave2);
                  });
  store_mat3(p.F, b, f);
  store_first(p.Jp + b.first, b.count, jp);
  summary.add_motion(v, c, f, jp, wave2);
}

}  // namespace

void g2p(const StepParams& step, const MaterialParams* materials, const ParticleView& p, ParticleRange range,
         const float* tile, BlockSummary* out) {
  Stencils stencils;
  Gathered gathered;
  for (int l = 0; l < kBatch; ++l) {
    for (int i = 0; i < 16; ++i) gathered.of[l][i] = 0.f;
  }
  Summary summary;
  for (std::size_t first = range.begin; first < range.end; first += kBatch) {
    int count = 0;
    for (int slot = 0; slot < kBatch && first + slot < range.end; slot += kLanes) {
      const Batch b = batch_at(range, first + slot);
      fill_stencils(p, b, slot, stencils);
      count += b.count;
    }
    gather(stencils, count, tile, gathered);
    for (int slot = 0; slot < count; slot += kLanes) {
      update_particles(step, materials, p, batch_at(range, first + slot), slot, gathered, summary);
    }
  }
  summary.write(*out);
}

}  // namespace firn::kernels::FIRN_ISA
