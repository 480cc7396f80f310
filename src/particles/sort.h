// SPDX-License-Identifier: MIT
// Puts particles into the order of their blocks, and within a block of their cells; ties keep their old
// order, so the order is total and the same for any number of threads. Positions are fixed point: sorting
// changes no particle's place.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "src/particles/blocks.h"
#include "src/particles/columns.h"

namespace firn {

// A place on the lattice: cells * 2^28 on each axis, from the world origin.
struct LatticePoint {
  std::int64_t x, y, z;
};

// First sort, by blocks and cells: gives the order of `count` points (fewer than 2^32), fills the blocks.
// `place` is asked more than once for a point, so that they need not be kept. Throws a usage Error for points
// beyond the addressable blocks, `dx` (m) being what the message needs.
std::vector<std::uint32_t> place_in_blocks(std::size_t count,
                                           const std::function<LatticePoint(std::size_t)>& place, double dx,
                                           ParticleBlocks& blocks);

// Is the particle gone? Asked of particles of blocks for which `may_lose` says so; both get the block's old
// place.
struct Leavers {
  std::function<bool(const BlockCoord&)> may_lose;  // empty: nobody leaves
  std::function<bool(const BlockCoord&, const std::int32_t x[3])> is_gone;
};

// Sorts again after drift, into the blocks and cells where the particles will be: `lead` (cells per m/s)
// times v, at most one cell, further on. So snow that moves drifts through its block's margin from one side
// to the other, which takes twice as long, and is in the best order half-way. A block's cells are in rows on
// the axis on which its snow moves most, a row's particles by the quarter of the cell that they are in: what
// drifts over into the row's next cell stays beside that cell's own, so the transfers, which load and flush a
// cell for each run of its particles, go on finding long runs. Positions and places ahead must be within one
// block of the block's own cells. Returns how many left; throws an unstable Error when snow reaches the end
// of the addressable world or 2^20 particles share one block.
class BlockSorter {
 public:
  std::size_t sort(ParticleColumns& particles, ParticleBlocks& blocks, const Leavers& leavers, float lead);
  std::size_t resident_bytes() const;

 private:
  struct Flow {  // particles that go from one old block to one new block
    BlockKey to;
    BlockCoord coord;
    std::uint32_t from;      // old block
    std::size_t first;       // particle of the old block
    std::size_t begin, end;  // in the scratch column
  };
  void group_by_destination(ParticleColumns&, const ParticleBlocks&, const Leavers&, float lead);
  void cut_new_blocks(ParticleBlocks& blocks);
  void order_rows(ParticleColumns&, const ParticleBlocks&);

  std::vector<std::uint32_t> order_;
  std::vector<std::vector<Flow>> flows_of_block_;
  std::vector<Flow> flows_;
  std::vector<std::size_t> first_flow_;  // of each new block, and the end
};

}  // namespace firn
