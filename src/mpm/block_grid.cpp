// SPDX-License-Identifier: MIT
#include "src/mpm/block_grid.h"

#include <algorithm>
#include <utility>

#include "src/core/parallel.h"
#include "src/mpm/block_table.h"
#include "src/mpm/colliders.h"

namespace firn {

namespace {

struct Candidate {
  BlockKey key;
  BlockCoord coord;
};

}  // namespace

void BlockGrid::find_blocks(const ParticleBlocks& occupied) {
  BlockTable table(2 * occupied.size());
  std::vector<Candidate> reach;
  for (const BlockCoord& block : occupied.coord) {
    const auto keys = keys_around(block);
    for (int n = 0; n < kernels::kNeighbours; ++n) {
      if (table.insert(keys[n])) reach.push_back({keys[n], neighbour(block, n)});
    }
  }
  parallel_sort(reach.begin(), reach.end(),
                [](const Candidate& a, const Candidate& b) { return a.key < b.key; });
  old_key_ = std::exchange(key_, {});
  key_.resize(reach.size());
  coord_.resize(reach.size());
  tiles_of_block_.resize(reach.size());
  blocks_of_tile_.resize(occupied.size());
  parallel_for(reach.size(), 256, [&](std::size_t g) {
    key_[g] = reach[g].key;
    coord_[g] = reach[g].coord;
    table.number(key_[g]) = static_cast<std::uint32_t>(g);
    tiles_of_block_[g].fill(kNone);
  });
  // Who is my neighbour n has me as its neighbour 26 - n.
  parallel_for(occupied.size(), 32, [&](std::size_t b) {
    const auto keys = keys_around(occupied.coord[b]);
    for (int n = 0; n < kernels::kNeighbours; ++n) {
      const std::uint32_t g = table.number(keys[n]);
      blocks_of_tile_[b][n] = g;
      tiles_of_block_[g][kernels::kNeighbours - 1 - n] = static_cast<std::uint32_t>(b);
    }
  });
}

// Blocks that were there before keep their contacts: these colliders stand.
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
  old_key_ = std::vector<BlockKey>();
}

void BlockGrid::rebuild(const ParticleBlocks& occupied, const std::vector<Collider>& colliders, double dx) {
  find_blocks(occupied);
  find_contacts(colliders, dx);
  tiles_.reserve_discarding(occupied.size() * kernels::kTileStride);
  nodes_.reserve_discarding(key_.size() * kernels::kBlockFloats);
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
    bytes += sizeof(std::vector<kernels::ContactNodes>) + contacts.capacity() * sizeof(kernels::ContactNodes);
  return bytes;
}

}  // namespace firn
