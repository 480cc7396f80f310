// SPDX-License-Identifier: MIT
// Where a particle's 3x3x3 stencil lies in its block's tile and what it weighs. Particles are taken kBatch at
// a time on every instruction set: their weights are computed in lanes, then each particle meets its nodes,
// one register being 4 z-nodes x {x, y, z, mass} (16 floats; two or four registers on narrower machines).
// What is the same for all lanes of such a register is read from memory as a broadcast; what differs from
// z-node to z-node is a record of four floats, spread over them.
#pragma once
#include "kernels/mpm/batch.h"
#include "kernels/simd/transpose.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr int kBatch = 16;
// How far ahead of a batch its columns are asked for. There are more of them than the hardware follows by
// itself.
inline constexpr std::size_t kAhead = 2 * kBatch;

// Position, velocity, deformation and what goes with them: what P2G reads and G2P reads or writes.
FIRN_INLINE void prefetch(const ParticleView& p, std::size_t at) {
  for (const std::int32_t* column : p.x) __builtin_prefetch(column + at);
  for (const float* column : p.v) __builtin_prefetch(column + at);
  for (const float* column : p.C) __builtin_prefetch(column + at);
  for (const float* column : p.F) __builtin_prefetch(column + at);
  __builtin_prefetch(p.Jp + at);
  __builtin_prefetch(p.object + at);
}

inline constexpr int kRowFloats = 16;                                    // 4 z-nodes
inline constexpr int kParts = kRowFloats / kLanes;                       // registers a row
inline constexpr int kRowStride = kTileSide * kNodeFloats;               // tile floats from y to y + 1
inline constexpr int kSlabStride = kTileSide * kTileSide * kNodeFloats;  // from x to x + 1

// w = {(1-f)^2/2, 3/4 - (f-1/2)^2, f^2/2}, the quadratic B-spline at a node and its two neighbours.
FIRN_INLINE Floats weight0(Floats f) { return splat(0.5f) * square(splat(1.f) - f); }
FIRN_INLINE Floats weight1(Floats f) { return splat(0.75f) - square(f - splat(0.5f)); }
FIRN_INLINE Floats weight2(Floats f) { return splat(0.5f) * square(f); }

struct Place {
  Ints offset;     // of the first stencil node, in tile floats
  Floats x, y, z;  // of the position in its cell, 0 .. 1
};

FIRN_INLINE Floats cell_fraction(Ints x) {
  return to_float(x & (kOneCell - 1)) * splat(1.f / static_cast<float>(kOneCell));
}

FIRN_INLINE Place place_of(const ParticleView& p, Batch b) {
  const Ints x = load_first(p.x[0] + b.first, b.count, 0);
  const Ints y = load_first(p.x[1] + b.first, b.count, 0);
  const Ints z = load_first(p.x[2] + b.first, b.count, 0);
  const Ints cx = (x >> kCellBits) + 1, cy = (y >> kCellBits) + 1, cz = (z >> kCellBits) + 1;
  return {cx * kSlabStride + cy * kRowStride + cz * kNodeFloats, cell_fraction(x), cell_fraction(y),
          cell_fraction(z)};
}

// Four floats a particle of a batch, in the order of transpose_groups.
struct Records4 {
  alignas(64) float of[kBatch * 4];

  const float* operator[](int l) const { return of + l / kLanes * (4 * kLanes) + record_of_lane(l % kLanes); }
};

// Columns of the particles in lanes [slot, slot + kLanes) -> records.
FIRN_INLINE void store_records(Floats x, Floats y, Floats z, Floats w, int slot, Records4& out) {
  Floats rows[4] = {x, y, z, w};
  transpose_groups(rows);
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) store(out.of + 4 * slot + k * kLanes, rows[k]);
}

// End of the run of particles that begins at `first` and shares one cell.
FIRN_INLINE int end_of_run(const std::int32_t* offset, int first, int count) {
  int last = first + 1;
  while (last < count && offset[last] == offset[first]) ++last;
  return last;
}

}  // namespace firn::kernels::FIRN_ISA
