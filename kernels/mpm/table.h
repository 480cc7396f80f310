// SPDX-License-Identifier: MIT
// The MPM kernels of one instruction set. A particle's result does not depend on the range it is processed
// in.
#pragma once
#include "kernels/mpm/views.h"

namespace firn::kernels {

struct MpmKernels {
  // Particles of one block -> its private tile (kTileStride floats, overwritten): momentum and mass, stress
  // included.
  void (*p2g)(const StepParams&, const MaterialParams* materials, const ParticleView&, ParticleRange,
              float* tile);

  // Sums into the 64 nodes of a block (kBlockFloats, overwritten) the parts of the tiles around it, in the
  // order of the neighbours; tiles[n] is the tile of the particle block at neighbour n, or null.
  void (*reduce_tiles)(const float* const tiles[kNeighbours], float* nodes);

  // Momentum -> velocity, gravity, then the contacts in order. The fourth float stays the mass. What a
  // contact gives to the nodes whose bit is set in `counted` (bit n: node n) is added to impulses[6 *
  // collider ..]: the impulse (kg m/s), then its moment about the block's first node (kg m/s cells).
  void (*grid_update)(const StepParams&, const ContactNodes* contacts, int contact_count,
                      std::uint64_t counted, float* nodes, double* impulses);

  // The velocities around one block -> its tile; blocks[n] is the grid block at neighbour n, never null.
  void (*assemble_tile)(const float* const blocks[kNeighbours], float* tile);

  // Tile -> v and C of the block's particles, then x, F, plasticity; tells what the next dt needs to know.
  void (*g2p)(const StepParams&, const MaterialParams* materials, const ParticleView&, ParticleRange,
              const float* tile, BlockSummary* summary);

  // The summary of particles as they stand, without a step (`strayed` and `clamped` stay 0).
  void (*summarise)(const MaterialParams* materials, const ParticleView&, ParticleRange,
                    BlockSummary* summary);

  // J per m^3 of placed volume, one a particle, at energy[i - range.begin].
  void (*elastic_energy)(const MaterialParams* materials, const ParticleView&, ParticleRange, float* energy);

  // For tests and benches: Kirchhoff stress (xx yy zz xy xz yz columns of `stride` floats) at tau[i - begin].
  void (*stress)(const MaterialParams* materials, const ParticleView&, ParticleRange, float* tau,
                 std::size_t stride);
  // F and Jp through the yield surface, in place; returns how many F changed.
  int (*project)(const MaterialParams* materials, const ParticleView&, ParticleRange);
  // Columns of `count` floats: F[9] -> U[9], s[3], V[9], row-major.
  void (*svd)(const float* const f[9], std::size_t count, float* const u[9], float* const s[3],
              float* const v[9]);
};

}  // namespace firn::kernels
