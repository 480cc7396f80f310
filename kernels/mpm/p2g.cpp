// SPDX-License-Identifier: MIT
// Particles -> tile: m_i += w m, (mv)_i += w m (v + (C - dt/rho0 4/dx^2 tau)(x_i - x_p)) (Hu et al. 2018,
// with V0 = m / rho0). Stress and the affine matrix are computed with one particle a lane, transposed to
// records of four floats, and each particle is spread with nodes in lanes. Particles of one cell follow one
// another, so their nine rows are summed in registers and reach the tile when the cell changes. Batches are
// cut from the range's start at kBatch particles on every instruction set: the order of additions, and so the
// bits, are the same.
#include "kernels/mpm/materials.h"
#include "kernels/mpm/stencil.h"

namespace firn::kernels::FIRN_ISA {

namespace {

// A batch on its way to the grid. With A = dx (C - dt/rho0 4/dx^2 tau), d in cells:
struct Scattered {
  alignas(64) std::int32_t offset[kBatch];
  alignas(64) float w_xy[9][kBatch];  // w_x w_y of the nine rows
  Records4 m_w_z;                     // m w_z of the three nodes of a row; 0
  Records4 corner;                    // v + A d at the stencil's first node; 1
  Records4 along[3];                  // columns of A; 0
};

// The part of A that is the stress.
FIRN_INLINE Sym3 push_of_stress(const StepParams& step, const MaterialParams* materials,
                                const ParticleView& p, Batch b) {
  const Deformation d = deformation_of(load_mat3(p.F, b, 1.f));
  const Floats jp = load(p.Jp, b, 1.f);
  const Floats zero = splat(0.f);
  const float scale = -4.f * step.dt * step.inv_dx;
  Sym3 push{zero, zero, zero, zero, zero, zero};
  for_each_object(materials, p.object, b,
                  [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                    const Sym3 own = model.stress(params, scale * params.inverse_density, d, jp);
                    push = all(mask) ? own : select(mask, own, push);
                  });
  return push;
}

FIRN_INLINE void fill_weights(const Place& at, Floats m, int slot, Scattered& out) {
  store(out.offset + slot, at.offset);
  const Floats wx[3] = {weight0(at.x), weight1(at.x), weight2(at.x)};
  const Floats wy[3] = {weight0(at.y), weight1(at.y), weight2(at.y)};
#pragma GCC unroll 9
  for (int ij = 0; ij < 9; ++ij) store(out.w_xy[ij] + slot, wx[ij / 3] * wy[ij % 3]);
  store_records(m * weight0(at.z), m * weight1(at.z), m * weight2(at.z), splat(0.f), slot, out.m_w_z);
}

FIRN_INLINE void fill_momentum(const StepParams& step, const MaterialParams* materials, const ParticleView& p,
                               Batch b, const Place& at, int slot, Scattered& out) {
  const Sym3 push = push_of_stress(step, materials, p, b);
  const Floats dx = splat(step.dx), half = splat(-0.5f), one = splat(1.f), zero = splat(0.f);
  const Vec3 v = load_vec3(p.v, b);
  const Mat3 c = load_mat3(p.C, b, 0.f);
  const Vec3 ax{fma(dx, c.m[0], push.xx), fma(dx, c.m[3], push.xy), fma(dx, c.m[6], push.xz)};
  const Vec3 ay{fma(dx, c.m[1], push.xy), fma(dx, c.m[4], push.yy), fma(dx, c.m[7], push.yz)};
  const Vec3 az{fma(dx, c.m[2], push.xz), fma(dx, c.m[5], push.yz), fma(dx, c.m[8], push.zz)};
  const Vec3 corner =
      add_scaled(add_scaled(add_scaled(v, az, half - at.z), ax, half - at.x), ay, half - at.y);
  store_records(corner.x, corner.y, corner.z, one, slot, out.corner);
  store_records(ax.x, ax.y, ax.z, zero, slot, out.along[0]);
  store_records(ay.x, ay.y, ay.z, zero, slot, out.along[1]);
  store_records(az.x, az.y, az.z, zero, slot, out.along[2]);
}

// z-node k in the four floats of node k.
alignas(64) constexpr float kStep[kRowFloats] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

// Part `part` of the rows of particles [first, last), which share one cell. The parts of a run follow one
// another directly: a node gets its sums in the order of the runs at every register width.
template <int part>
FIRN_INLINE void spread_run(const Scattered& s, int first, int last, float* tile) {
  Floats sum[9];
#pragma GCC unroll 9
  for (int ij = 0; ij < 9; ++ij) sum[ij] = splat(0.f);
  const Floats steps = load(kStep + part * kLanes);
  for (int l = first; l < last; ++l) {
    const Floats wz = load_spread4(s.m_w_z[l], part);
    const Floats step_x = load_repeated4(s.along[0][l]) * wz, step_y = load_repeated4(s.along[1][l]) * wz;
    Floats q = fma(load_repeated4(s.along[2][l]), steps, load_repeated4(s.corner[l])) * wz;
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      Floats row = q;
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) {
        sum[3 * i + j] = fma(row, splat(s.w_xy[3 * i + j][l]), sum[3 * i + j]);
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

FIRN_INLINE void spread(const Scattered& s, int count, float* tile) {
  for (int first = 0; first < count;) {
    const int last = end_of_run(s.offset, first, count);
    spread_run<0>(s, first, last, tile);
    if constexpr (kParts > 1) spread_run<1>(s, first, last, tile);
    if constexpr (kParts > 2) {
      spread_run<2>(s, first, last, tile);
      spread_run<3>(s, first, last, tile);
    }
    first = last;
  }
}

}  // namespace

void p2g(const StepParams& step, const MaterialParams* materials, const ParticleView& p, ParticleRange range,
         float* tile) {
  for (int i = 0; i < kTileStride; i += kLanes) store(tile + i, splat(0.f));
  Scattered scattered;
  for (std::size_t first = range.begin; first < range.end; first += kBatch) {
    int count = 0;
    for (int slot = 0; slot < kBatch && first + slot < range.end; slot += kLanes) {
      count += with_batch(range, first + slot, [&](Batch b) FIRN_INLINE_LAMBDA {
        const Place at = place_of(p, b);
        fill_weights(at, load(p.m, b, 0.f), slot, scattered);
        fill_momentum(step, materials, p, b, at, slot, scattered);
      });
    }
    prefetch(p, first + kAhead);
    __builtin_prefetch(p.m + first + kAhead);
    spread(scattered, count, tile);
  }
}

}  // namespace firn::kernels::FIRN_ISA
