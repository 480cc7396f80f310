// SPDX-License-Identifier: MIT
// The sparse grid: the blocks that particles can reach before the next sort (each occupied block and its
// neighbours), found again whenever the particles are sorted. It grows with the snow and costs only where
// snow is.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "kernels/mpm/views.h"
#include "src/core/aligned.h"
#include "src/mpm/solver.h"
#include "src/particles/blocks.h"

namespace firn {

class BlockGrid {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  using Neighbours = std::array<std::uint32_t, kernels::kNeighbours>;

  void rebuild(const ParticleBlocks& occupied, const std::vector<Collider>& colliders, double dx);

  void forget_contacts() { key_.clear(); }  // the next rebuild() finds all anew

  std::size_t size() const { return key_.size(); }
  std::size_t resident_bytes() const;

  float* tile(std::size_t particle_block) { return tiles_.data() + particle_block * kernels::kTileStride; }
  float* nodes(std::size_t block) { return nodes_.data() + block * kernels::kBlockFloats; }
  const BlockCoord& coord(std::size_t block) const { return coord_[block]; }
  // With the colliders that stand.
  const std::vector<kernels::ContactNodes>& contacts(std::size_t block) const { return contacts_[block]; }

  // Particle blocks around a grid block (kNone where no particles are), and the grid block at the place of a
  // particle block.
  const Neighbours& tiles_around(std::size_t block) const { return tiles_of_block_[block]; }
  std::size_t block_of(std::size_t particle_block) const {
    return blocks_of_tile_[particle_block][kernels::kNeighbours / 2];
  }

  // The tiles around a grid block (null where no particles are, or none that count) and the grid blocks
  // around a particle block.
  template <class Counts>
  void tiles_around(std::size_t block, Counts&& counts, const float* (&out)[kernels::kNeighbours]) const {
    for (int n = 0; n < kernels::kNeighbours; ++n) {
      const std::uint32_t t = tiles_of_block_[block][n];
      out[n] = t != kNone && counts(t) ? tiles_.data() + std::size_t{t} * kernels::kTileStride : nullptr;
    }
  }
  void blocks_around(std::size_t particle_block, const float* (&out)[kernels::kNeighbours]) const;

 private:
  void find_blocks(const ParticleBlocks& occupied);
  void find_contacts(const std::vector<Collider>& colliders, double dx);

  std::vector<BlockKey> key_;  // ascending
  std::vector<BlockCoord> coord_;
  std::vector<Neighbours> tiles_of_block_, blocks_of_tile_;
  std::vector<std::vector<kernels::ContactNodes>> contacts_;
  std::vector<BlockKey> old_key_;  // of contacts_ until find_contacts
  AlignedArray<float> tiles_, nodes_;
};

}  // namespace firn
