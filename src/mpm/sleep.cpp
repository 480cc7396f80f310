// SPDX-License-Identifier: MIT
#include "src/mpm/sleep.h"

#include <cmath>
#include <limits>

#include "src/core/parallel.h"

namespace firn {

namespace {

// Shares of the natural speed sqrt(g dx) and time sqrt(dx / g) of a cell under gravity. Snow in flight
// gathers the speed in a 400th of the time.
constexpr double kQuietSpeed = 0.005;
constexpr double kQuietTime = 2;

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

RestLimits rest_limits(const SimulationSetup& setup) {
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
  std::vector<char> read(grid.size());
  parallel_for(grid.size(), 256, [&](std::size_t g) {
    for (const std::uint32_t b : grid.tiles_around(g)) read[g] |= b != BlockGrid::kNone && awake[b];
  });
  collect(count, awake_, [&](std::uint32_t b) { return awake[b]; });
  collect(count, scattering_, [&](std::uint32_t b) { return activity_[b] != Activity::deep; });
  collect(grid.size(), grid_blocks_, [&](std::uint32_t g) { return read[g]; });
  return fallen_asleep;
}

std::size_t ActiveBlocks::resident_bytes() const {
  return activity_.capacity() * sizeof(Activity) +
         (awake_.capacity() + scattering_.capacity() + grid_blocks_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace firn
