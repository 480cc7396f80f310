// SPDX-License-Identifier: MIT
// Which blocks take part in a step. Snow at rest sleeps: a block in which, and in whose 26 neighbours,
// nothing has moved for a while stands still, with v = C = 0 and its F as it was.
//
//   deep    asleep among sleepers      no work
//   held    asleep beside awake snow   P2G: its mass and stress carry and push what is awake
//   awake   all within a block of      P2G, G2P
//           what moved of late
//
// Tiles of blocks that are no neighbours do not overlap, so awake snow needs nothing from deep sleepers, and
// what moves cannot touch a sleeper before it has, as a neighbour, woken it. So too for stress: a wave that
// comes to the far side of a quiet block wakes what lies behind before it has passed through.
#pragma once
#include <cstdint>
#include <vector>

#include "src/mpm/block_grid.h"
#include "src/particles/blocks.h"

namespace firn {

// What counts as motion, and how long snow must be without it. docs/decisions/008 has the reasons.
struct RestLimits {
  float speed;  // m/s, of a particle or, by its C, of the snow half a cell from it
  float time;   // s; infinite: snow never sleeps
};
RestLimits rest_limits(const SolverSetup& setup);

enum class Activity : std::uint8_t { deep, held, awake };

class ActiveBlocks {
 public:
  // From `calm` of the blocks. Returns the blocks that have fallen asleep since the last call, or since
  // forget(): all that sleep.
  std::vector<std::uint32_t> find(const ParticleBlocks& blocks, const BlockGrid& grid, float time);
  void forget() { activity_.clear(); }  // blocks are others than they were

  // Ascending.
  const std::vector<std::uint32_t>& awake() const { return awake_; }              // particle blocks
  const std::vector<std::uint32_t>& scattering() const { return scattering_; }    // awake and held
  const std::vector<std::uint32_t>& grid_blocks() const { return grid_blocks_; }  // that the awake ones read

  // Bit n: node n of a grid block is one that awake snow reaches; that only sleeping snow does.
  std::uint64_t awake_nodes(std::size_t grid_block) const { return awake_nodes_[grid_block]; }
  std::uint64_t sleeping_nodes(std::size_t grid_block) const { return sleeping_nodes_[grid_block]; }

  Activity of(std::size_t particle_block) const { return activity_[particle_block]; }
  bool all_awake() const { return awake_.size() == activity_.size(); }
  std::size_t resident_bytes() const;

 private:
  std::vector<Activity> activity_;
  std::vector<std::uint32_t> awake_, scattering_, grid_blocks_;
  std::vector<std::uint64_t> awake_nodes_, sleeping_nodes_;
};

}  // namespace firn
