// SPDX-License-Identifier: MIT
#include "src/mpm/sleep.h"

#include <array>
#include <cmath>
#include <limits>

#include "src/core/parallel.h"

namespace firn {

namespace {

// Shares of the natural speed sqrt(g dx) and time sqrt(dx / g) of a cell under gravity. Snow in flight
// gathers the speed in a 400th of the time.
constexpr double kQuietSpeed = 0.005;
constexpr double kQuietTime = 2;

// The nodes of a block that the tile of the particle block at its neighbour n reaches: nodes -1 .. 6 of that
// one.
constexpr std::uint64_t reached_from(int n) {
  const int from[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
  std::uint64_t nodes = 0;
  for (int i = 0; i < kernels::kBlockNodes; ++i) {
    const int at[3] = {i / 16, i / 4 % 4, i % 4};
    bool reached = true;
    for (int axis = 0; axis < 3; ++axis) {
      const int node = at[axis] - 4 * from[axis];
      reached = reached && node >= -1 && node < kernels::kTileSide - 1;
    }
    if (reached) nodes |= std::uint64_t{1} << i;
  }
  return nodes;
}
constexpr std::array<std::uint64_t, kernels::kNeighbours> kReachedFrom = [] {
  std::array<std::uint64_t, kernels::kNeighbours> nodes{};
  for (int n = 0; n < kernels::kNeighbours; ++n) nodes[static_cast<std::size_t>(n)] = reached_from(n);
  return nodes;
}();

template <class Keep>
void collect(std::size_t count, std::vector<std::uint32_t>& out, Keep&& keep) {
  out.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    if (keep(i)) out.push_back(i);
  }
}

// Is it so for a particle block or one of its neighbours?
template <class Is>
bool any_around(const BlockGrid& grid, std::size_t particle_block, Is&& is) {
  for (const std::uint32_t b : grid.tiles_around(grid.block_of(particle_block))) {
    if (b != BlockGrid::kNone && is(b)) return true;
  }
  return false;
}

}  // namespace

RestLimits rest_limits(const SolverSetup& setup) {
  const double g = setup.gravity.norm();
  if (!setup.sleep || !(g > 0)) return {0, std::numeric_limits<float>::infinity()};
  return {static_cast<float>(kQuietSpeed * std::sqrt(g * setup.dx)),
          static_cast<float>(kQuietTime * std::sqrt(setup.dx / g))};
}

std::vector<std::uint32_t> ActiveBlocks::find(const ParticleBlocks& blocks, const BlockGrid& grid,
                                              float time) {
  const std::size_t count = blocks.size();
  std::vector<char> awake(count);
  parallel_for(count, 256, [&](std::size_t b) {
    awake[b] = any_around(grid, b, [&](std::uint32_t other) { return blocks.calm[other] < time; });
  });
  std::vector<std::uint32_t> fallen_asleep;
  collect(count, fallen_asleep, [&](std::uint32_t b) {
    return !awake[b] && (activity_.empty() || activity_[b] == Activity::awake);
  });
  activity_.resize(count);
  parallel_for(count, 256, [&](std::size_t b) {
    const bool held = !awake[b] && any_around(grid, b, [&](std::uint32_t other) { return awake[other]; });
    activity_[b] = awake[b] ? Activity::awake : held ? Activity::held : Activity::deep;
  });
  awake_nodes_.resize(grid.size());
  sleeping_nodes_.resize(grid.size());
  parallel_for(grid.size(), 256, [&](std::size_t g) {
    std::uint64_t reached[2] = {0, 0};  // by sleeping snow, by awake snow
    for (std::size_t n = 0; n < kernels::kNeighbours; ++n) {
      const std::uint32_t b = grid.tiles_around(g)[n];
      if (b != BlockGrid::kNone) reached[awake[b] != 0] |= kReachedFrom[n];
    }
    awake_nodes_[g] = reached[1];
    sleeping_nodes_[g] = reached[0] & ~reached[1];
  });
  collect(count, awake_, [&](std::uint32_t b) { return awake[b]; });
  collect(count, scattering_, [&](std::uint32_t b) { return activity_[b] != Activity::deep; });
  collect(grid.size(), grid_blocks_, [&](std::uint32_t g) { return awake_nodes_[g] != 0; });
  return fallen_asleep;
}

std::size_t ActiveBlocks::resident_bytes() const {
  return activity_.capacity() * sizeof(Activity) +
         (awake_.capacity() + scattering_.capacity() + grid_blocks_.capacity()) * sizeof(std::uint32_t) +
         (awake_nodes_.capacity() + sleeping_nodes_.capacity()) * sizeof(std::uint64_t);
}

}  // namespace firn
