// SPDX-License-Identifier: MIT
// Where a particle's 3x3x3 stencil lies in its block's tile and what it weighs. Particles are taken kBatch at
// a time on every instruction set: their weights are computed in lanes, then each particle is spread over its
// nodes, one register being 4 z-nodes x {x, y, z, mass} (16 floats; two or four registers on narrower
// machines).
#pragma once
#include "kernels/mpm/batch.h"
#include "kernels/simd/transpose.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr int kBatch = 16;
inline constexpr int kRowFloats = 16;                                    // 4 z-nodes
inline constexpr int kRowStride = kTileSide * kNodeFloats;               // tile floats from y to y + 1
inline constexpr int kSlabStride = kTileSide * kTileSide * kNodeFloats;  // from x to x + 1

struct Stencils {
  alignas(64) std::int32_t offset[kBatch];  // of the first stencil node, in tile floats
  alignas(64) float fraction[3][kBatch];    // of the position in its cell, 0 .. 1
  alignas(64) float wx[3][kBatch], wy[3][kBatch];
};

// w = {(1-f)^2/2, 3/4 - (f-1/2)^2, f^2/2} as quadratics in f.
FIRN_INLINE Floats weight0(Floats f) { return splat(0.5f) * square(splat(1.f) - f); }
FIRN_INLINE Floats weight1(Floats f) { return splat(0.75f) - square(f - splat(0.5f)); }
FIRN_INLINE Floats weight2(Floats f) { return splat(0.5f) * square(f); }

FIRN_INLINE Floats cell_fraction(Ints x) {
  return to_float(x & (kOneCell - 1)) * splat(1.f / static_cast<float>(kOneCell));
}

// Fills lanes [slot, slot + kLanes) of the stencils with the particles of `b`.
FIRN_INLINE void fill_stencils(const ParticleView& p, Batch b, int slot, Stencils& out) {
  const Ints x = load_first(p.x[0] + b.first, b.count, 0);
  const Ints y = load_first(p.x[1] + b.first, b.count, 0);
  const Ints z = load_first(p.x[2] + b.first, b.count, 0);
  const Ints cx = (x >> kCellBits) + 1, cy = (y >> kCellBits) + 1, cz = (z >> kCellBits) + 1;
  store(out.offset + slot, cx * kSlabStride + cy * kRowStride + cz * kNodeFloats);
  const Floats fx = cell_fraction(x), fy = cell_fraction(y), fz = cell_fraction(z);
  store(out.fraction[0] + slot, fx);
  store(out.fraction[1] + slot, fy);
  store(out.fraction[2] + slot, fz);
  store(out.wx[0] + slot, weight0(fx));
  store(out.wx[1] + slot, weight1(fx));
  store(out.wx[2] + slot, weight2(fx));
  store(out.wy[0] + slot, weight0(fy));
  store(out.wy[1] + slot, weight1(fy));
  store(out.wy[2] + slot, weight2(fy));
}

// Constants of z-node k in the four floats of node k: part `part` of a row.
struct RowConstants {
  alignas(64) float node[kRowFloats];                                // k - 1/2
  alignas(64) float w0[kRowFloats], w1[kRowFloats], w2[kRowFloats];  // weight = w0 + f (w1 + f w2)
};
inline constexpr RowConstants kRow = {
    {-.5f, -.5f, -.5f, -.5f, .5f, .5f, .5f, .5f, 1.5f, 1.5f, 1.5f, 1.5f, 2.5f, 2.5f, 2.5f, 2.5f},
    {.5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f, 0, 0, 0, 0, 0, 0, 0, 0},
    {-1, -1, -1, -1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0},
    {.5f, .5f, .5f, .5f, -1, -1, -1, -1, .5f, .5f, .5f, .5f, 0, 0, 0, 0}};

FIRN_INLINE Floats row_weight(int part, Floats fz) {
  const int at = part * kLanes;
  return fma(fma(load(kRow.w2 + at), fz, load(kRow.w1 + at)), fz, load(kRow.w0 + at));
}
FIRN_INLINE Floats row_distance(int part, Floats fz) { return load(kRow.node + part * kLanes) - fz; }

}  // namespace firn::kernels::FIRN_ISA
