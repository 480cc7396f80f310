// SPDX-License-Identifier: MIT
#include "src/mpm/block_grid.h"

#include <algorithm>
#include <utility>

#include "src/core/parallel.h"
#include "src/mpm/colliders.h"

namespace firn {

namespace {

constexpr std::uint32_t kNone = UINT32_MAX;

struct Candidate {
  BlockKey key;
  BlockCoord coord;
};

}  // namespace

void BlockGrid::find_blocks(const ParticleBlocks& occupied) {
  std::vector<Candidate> reach(occupied.size() * kernels::kNeighbours);
  parallel_for(occupied.size(), 64, [&](std::size_t b) {
    for (int n = 0; n < kernels::kNeighbours; ++n) {
      const BlockCoord coord = neighbour(occupied.coord[b], n);
      reach[b * kernels::kNeighbours + n] = {block_key(coord), coord};
    }
  });
  // Equal keys are equal blocks: which of them comes first makes no difference.
  parallel_sort(reach.begin(), reach.end(),
                [](const Candidate& a, const Candidate& b) { return a.key < b.key; });
  const auto same = [](const Candidate& a, const Candidate& b) { return a.key == b.key; };
  reach.erase(std::unique(reach.begin(), reach.end(), same), reach.end());

  old_key_ = std::exchange(key_, {});
  key_.reserve(reach.size());
  coord_.clear();
  for (const Candidate& c : reach) {
    key_.push_back(c.key);
    coord_.push_back(c.coord);
  }
  tiles_of_block_.resize(reach.size());
  blocks_of_tile_.resize(occupied.size());
  const auto index = [](const std::vector<BlockKey>& keys, const BlockCoord& coord) {
    const auto found = find_block(keys, block_key(coord));
    return found ? static_cast<std::uint32_t>(*found) : kNone;
  };
  parallel_for(reach.size(), 32, [&](std::size_t g) {
    for (int n = 0; n < kernels::kNeighbours; ++n)
      tiles_of_block_[g][n] = index(occupied.key, neighbour(coord_[g], n));
  });
  parallel_for(occupied.size(), 32, [&](std::size_t b) {
    for (int n = 0; n < kernels::kNeighbours; ++n)
      blocks_of_tile_[b][n] = index(key_, neighbour(occupied.coord[b], n));
  });
}

// Blocks that were there before keep their contacts: colliders do not move.
void BlockGrid::find_contacts(const std::vector<Collider>& colliders, double dx) {
  std::vector<std::vector<kernels::ContactNodes>> old = std::exchange(contacts_, {});
  contacts_.resize(key_.size());
  parallel_for(key_.size(), 8, [&](std::size_t g) {
    if (const auto known = find_block(old_key_, key_[g])) {
      contacts_[g] = std::move(old[*known]);
    } else {
      contacts_[g] = contacts_of_block(colliders, coord_[g], dx);
    }
  });
  old_key_ = {};
}

void BlockGrid::rebuild(const ParticleBlocks& occupied, const std::vector<Collider>& colliders, double dx) {
  find_blocks(occupied);
  find_contacts(colliders, dx);
  tiles_.reserve_discarding(occupied.size() * kernels::kTileStride);
  nodes_.reserve_discarding(key_.size() * kernels::kBlockFloats);
}

void BlockGrid::tiles_around(std::size_t block, const float* (&out)[kernels::kNeighbours]) const {
  for (int n = 0; n < kernels::kNeighbours; ++n) {
    const std::uint32_t tile = tiles_of_block_[block][n];
    out[n] = tile == kNone ? nullptr : tiles_.data() + static_cast<std::size_t>(tile) * kernels::kTileStride;
  }
}

void BlockGrid::blocks_around(std::size_t particle_block, const float* (&out)[kernels::kNeighbours]) const {
  for (int n = 0; n < kernels::kNeighbours; ++n) {
    out[n] =
        nodes_.data() + static_cast<std::size_t>(blocks_of_tile_[particle_block][n]) * kernels::kBlockFloats;
  }
}

std::size_t BlockGrid::resident_bytes() const {
  std::size_t bytes = key_.capacity() * sizeof(BlockKey) + coord_.capacity() * sizeof(BlockCoord) +
                      (tiles_of_block_.capacity() + blocks_of_tile_.capacity()) * sizeof(Neighbours) +
                      tiles_.resident_bytes() + nodes_.resident_bytes();
  for (const auto& contacts : contacts_)
    bytes += sizeof contacts + contacts.capacity() * sizeof(kernels::ContactNodes);
  return bytes;
}

}  // namespace firn
