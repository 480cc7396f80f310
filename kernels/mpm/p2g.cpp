// SPDX-License-Identifier: MIT
// Particles -> tile: m_i += w m, (mv)_i += w (m v + (m C - dt V0 4/dx^2 tau)(x_i - x_p)) (Hu et al. 2018).
// Stress and the affine matrix are computed with one particle a lane, transposed to one record a particle,
// and each record is spread with nodes in lanes. Particles of one cell follow one another, so their nine rows
// are summed in registers and reach the tile when the cell changes. Batches are cut from the range's start at
// kBatch particles on every instruction set: the order of additions, and so the bits, are the same.
#include "kernels/mpm/materials.h"
#include "kernels/mpm/stencil.h"

namespace firn::kernels::FIRN_ISA {

namespace {

// One particle as it goes to the grid: m v and m, then the columns of dx (m C - dt V0 4/dx^2 tau).
struct Records {
  alignas(64) float of[kBatch][16];
};

FIRN_INLINE Sym3 batch_stress(const MaterialParams* materials, const ParticleView& p, Batch b) {
  const Mat3 f = load_mat3(p.F, b, 1.f);
  const Floats jp = load(p.Jp, b, 1.f);
  const Floats zero = splat(0.f);
  Sym3 tau{zero, zero, zero, zero, zero, zero};
  for_each_object(materials, p.object, b,
                  [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                    const Sym3 own = model.stress(params, f, jp);
                    tau = all(mask) ? own : select(mask, own, tau);
                  });
  return tau;
}

FIRN_INLINE void fill_records(const StepParams& step, const MaterialParams* materials, const ParticleView& p,
                              Batch b, int slot, Records& out) {
  const Floats m = load(p.m, b, 0.f);
  const Vec3 v = load_vec3(p.v, b);
  const Mat3 c = load_mat3(p.C, b, 0.f);
  const Sym3 tau = batch_stress(materials, p, b) * (load(p.V0, b, 0.f) * splat(-4.f * step.dt * step.inv_dx));
  const Floats mdx = m * splat(step.dx);
  const Floats zero = splat(0.f);
  Floats r[16] = {m * v.x,
                  m * v.y,
                  m * v.z,
                  m,
                  fma(mdx, c.m[0], tau.xx),
                  fma(mdx, c.m[3], tau.xy),
                  fma(mdx, c.m[6], tau.xz),
                  zero,
                  fma(mdx, c.m[1], tau.xy),
                  fma(mdx, c.m[4], tau.yy),
                  fma(mdx, c.m[7], tau.yz),
                  zero,
                  fma(mdx, c.m[2], tau.xz),
                  fma(mdx, c.m[5], tau.yz),
                  fma(mdx, c.m[8], tau.zz),
                  zero};
#pragma GCC unroll 4
  for (int part = 0; part < 16 / kLanes; ++part) {
    transpose(r + part * kLanes);
#pragma GCC unroll 16
    for (int l = 0; l < kLanes; ++l) store(out.of[slot + l] + part * kLanes, r[part * kLanes + l]);
  }
}

// Part `part` of the rows of particles [first, last), which share one cell. The parts of a run follow one
// another directly: a node gets its sums in the order of the runs at every register width.
template <int part>
FIRN_INLINE void spread_run(const Stencils& s, const Records& records, int first, int last, float* tile) {
  Floats sum[9];
#pragma GCC unroll 9
  for (int ij = 0; ij < 9; ++ij) sum[ij] = splat(0.f);
  for (int l = first; l < last; ++l) {
    const float* record = records.of[l];
    const Floats fz = splat(s.fraction[2][l]);
    const Floats wz = row_weight(part, fz);
    const Floats ax = load_repeated4(record + 4), ay = load_repeated4(record + 8);
    Floats q = fma(load_repeated4(record + 12), row_distance(part, fz), load_repeated4(record));
    q = fma(ax, splat(-0.5f - s.fraction[0][l]), q);
    q = fma(ay, splat(-0.5f - s.fraction[1][l]), q);
    q = q * wz;
    const Floats step_x = ax * wz, step_y = ay * wz;
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      Floats row = q;
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) {
        sum[3 * i + j] = fma(row, splat(s.wx[i][l] * s.wy[j][l]), sum[3 * i + j]);
        row = row + step_y;
      }
      q = q + step_x;
    }
  }
  float* at = tile + s.offset[first] + part * kLanes;
#pragma GCC unroll 9
  for (int ij = 0; ij < 9; ++ij) {
    float* row = at + ij / 3 * kSlabStride + ij % 3 * kRowStride;
    store(row, load(row) + sum[ij]);
  }
}

FIRN_INLINE void spread(const Stencils& s, const Records& records, int count, float* tile) {
  for (int first = 0; first < count;) {
    int last = first + 1;
    while (last < count && s.offset[last] == s.offset[first]) ++last;
    spread_run<0>(s, records, first, last, tile);
    if constexpr (kLanes < 16) spread_run<1>(s, records, first, last, tile);
    if constexpr (kLanes < 8) {
      spread_run<2>(s, records, first, last, tile);
      spread_run<3>(s, records, first, last, tile);
    }
    first = last;
  }
}

}  // namespace

void p2g(const StepParams& step, const MaterialParams* materials, const ParticleView& p, ParticleRange range,
         float* tile) {
  for (int i = 0; i < kTileStride; i += kLanes) store(tile + i, splat(0.f));
  Stencils stencils;
  Records records;
  for (std::size_t first = range.begin; first < range.end; first += kBatch) {
    int count = 0;
    for (int slot = 0; slot < kBatch && first + slot < range.end; slot += kLanes) {
      const Batch b = batch_at(range, first + slot);
      fill_stencils(p, b, slot, stencils);
      fill_records(step, materials, p, b, slot, records);
      count += b.count;
    }
    spread(stencils, records, count, tile);
  }
}

}  // namespace firn::kernels::FIRN_ISA
