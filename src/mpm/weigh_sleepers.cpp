// SPDX-License-Identifier: MIT
// The force of the colliders on snow that sleeps (contact_forces.h), kept up to date when blocks fall asleep
// or wake: only grid blocks whose sleeping nodes are no longer the same are looked at again.
#include <algorithm>

#include "src/core/parallel.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// Any other would do: the force does not depend on it.
constexpr double kDt = 1e-3;  // s

}  // namespace

// The contacts of a grid block now: of colliders that stand, then of those that move. `room` holds them where
// there are both.
const std::vector<kernels::ContactNodes>& Solver::State::contacts_at(
    std::size_t g, std::vector<kernels::ContactNodes>& room) const {
  const auto& standing = grid.contacts(g);
  room = contacts_of_block(moving, grid.coord(g), setup.dx);
  if (room.empty()) return standing;
  room.insert(room.begin(), standing.begin(), standing.end());
  return room;
}

// The forces on the sleeping nodes of a grid block, from the tiles of the sleeping blocks around it.
std::vector<SleepingNodes::Force> Solver::State::forces_on_sleepers(
    std::size_t g, const std::vector<kernels::ContactNodes>& contacts) const {
  const auto sleeps = [&](std::size_t b) { return active.of(b) != Activity::awake; };
  const float* tiles[kernels::kNeighbours];
  alignas(64) float nodes[kernels::kBlockFloats];
  std::vector<double> sums(kernels::kImpulseParts * setup.colliders.size());
  grid.tiles_around(g, sleeps, tiles);
  kernels.mpm.reduce_tiles(tiles, nodes);
  kernels.mpm.grid_update(step_params(kDt), contacts.data(), static_cast<int>(contacts.size()),
                          sleeping[g].nodes, nodes, sums.data());
  std::vector<SleepingNodes::Force> forces;
  for (std::uint32_t k = 0; k < setup.colliders.size(); ++k) {
    const Impulse given = take_impulse(&sums[kernels::kImpulseParts * k], grid.coord(g), setup.dx);
    if (!given.is_zero()) forces.push_back({k, {given.linear / kDt, given.angular / kDt}});
  }
  return forces;
}

void Solver::State::weigh_sleepers() {
  std::fill(forces.on_sleepers.begin(), forces.on_sleepers.end(), Impulse{});
  if (active.all_awake()) return sleeping.clear();
  sleeping.resize(grid.size());
  std::vector<std::vector<kernels::ContactNodes>> contacts(grid.size());  // where they are to be looked at
  std::vector<char> wanted(blocks.size());                                // tiles
  parallel_for(grid.size(), 64, [&](std::size_t g) {
    const std::uint64_t nodes = active.sleeping_nodes(g);
    if (nodes == sleeping[g].nodes) return;
    sleeping[g] = {nodes, {}};
    std::vector<kernels::ContactNodes> room;
    if (nodes != 0) contacts[g] = contacts_at(g, room);
  });
  std::vector<std::uint32_t> anew;
  for (std::uint32_t g = 0; g < grid.size(); ++g) {
    if (contacts[g].empty()) continue;
    anew.push_back(g);
    for (const std::uint32_t b : grid.tiles_around(g)) {
      if (b != BlockGrid::kNone && active.of(b) != Activity::awake) wanted[b] = 1;
    }
  }
  const kernels::StepParams params = step_params(kDt);
  parallel_for(anew.empty() ? 0 : blocks.size(), 1, [&](std::size_t b) {
    if (!wanted[b]) return;
    kernels.mpm.p2g(params, materials.data(), particles.view(), range_of(b), grid.tile(b));
    held_dt[b] = 0;
  });
  parallel_for(anew.size(), 4, [&](std::size_t i) {
    sleeping[anew[i]].forces = forces_on_sleepers(anew[i], contacts[anew[i]]);
  });
  for (const SleepingNodes& block : sleeping) {
    for (const auto& [collider, force] : block.forces) forces.on_sleepers[collider] += force;
  }
}

}  // namespace firn
