// SPDX-License-Identifier: MIT
// One step of explicit MLS-MPM:
//
//   sort (when a particle has left its block's margin), drag of the air (where the scene has some)
//   P2G         particle blocks -> private tiles                     reads x v C F Jp m
//   grid update tiles -> sums of nodes -> velocity, gravity, contact
//   G2P         nodes -> v C, then x F Jp, and the maxima that choose the next dt
//
// Blocks that sleep (sleep.h) are left out; colliders that move wake them.
//
// Each stage is one parallel loop over blocks in which every block writes only its own memory: no atomics, no
// colours, and the same bits for any number of threads.
#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/mpm/colliders.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// How far the fastest particle goes until it lies where it is sorted to: nearly the margin of a block, the
// rest is for particles that turn round.
constexpr float kLeadCells = 0.75f;

// Grid blocks whose contact impulses are summed together: more tasks against less to sum.
constexpr std::size_t kImpulseChunk = 8;

// Did anything in a block move? What C does half a cell from a particle counts.
bool is_quiet(const kernels::BlockSummary& seen, double dx, float speed) {
  const float speed2 = speed * speed, half_cell = static_cast<float>(dx / 2);
  return !seen.strayed && seen.speed2 <= speed2 && seen.rate2 * (half_cell * half_cell) <= speed2;
}

void set_at_rest(const kernels::ParticleView& p, kernels::ParticleRange range) {
  const auto clear = [&](float* column) { std::fill(column + range.begin, column + range.end, 0.f); };
  for (float* column : p.v) clear(column);
  for (float* column : p.C) clear(column);
}

// Who has left through the domain's boundary. Only blocks near it are asked particle by particle: a block's
// particles lie within 7 cells of its centre.
Leavers leavers_of(const SolverSetup& setup) {
  if (!setup.domain) return {};
  const double dx = setup.dx;
  const Shape& domain = *setup.domain;
  return {[&domain, dx](const BlockCoord& block) {
            return signed_distance(domain, world_in_block(block, Vec3::Constant(2.0), dx)) > -7 * dx;
          },
          [&domain, dx](const BlockCoord& block, const std::int32_t x[3]) {
            const Vec3 cells = Vec3(x[0], x[1], x[2]) / kernels::kOneCell;
            return signed_distance(domain, world_in_block(block, cells, dx)) > 0;
          }};
}

}  // namespace

void Solver::State::sort() {
  const float speed = std::sqrt(summary.speed2);
  left += sorter.sort(particles, blocks, leavers_of(setup), speed > 0 ? kLeadCells / speed : 0.f);
  rebuild_grid();
}

void Solver::State::rebuild_grid() {
  grid.rebuild(blocks, setup.colliders, setup.dx);
  summaries.assign(blocks.size(), {});
  sleeping.clear();
  active.forget();
  find_active();
  bottom = budget.top;
  reach = {};
  for (const BlockCoord& block : blocks.coord) {
    for (int corner = 0; corner < 8; ++corner) {  // of the block and its margin
      const Vec3 cells(corner & 1 ? 5 : -1, corner & 2 ? 5 : -1, corner & 4 ? 5 : -1);
      const Vec3 x = world_in_block(block, cells, setup.dx);
      bottom = std::min(bottom, height_against(setup.gravity, x));
      reach.include(x);
    }
  }
}

// Blocks that sleep, or are about to, beside a collider that moves.
void Solver::State::wake_beside_colliders() {
  std::vector<char> touched(blocks.size());
  for (const MovingCollider& collider : moving) {
    if (collider.velocity.is_zero()) continue;
    parallel_for(blocks.size(), 256, [&](std::size_t b) {
      touched[b] |= blocks.calm[b] > 0 && touched_by(collider, blocks.coord[b], setup.dx);
    });
  }
  bool woken = false;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (!touched[b]) continue;
    woken = woken || blocks.calm[b] >= rest.time;
    blocks.calm[b] = 0;
  }
  if (woken) find_active();
}

// dv/dt = -k |v| v. With x = dt k |v|, what is left of v is 1 - x to second order, so that with this step's
// gravity the fall ends at the terminal velocity, and never less than nothing, however long the step. On
// particles, not on nodes: snow of several objects may share a node.
void Solver::State::brake_in_air(double dt) {
  const kernels::ParticleView p = particles.view();
  parallel_for(active.awake().size(), 1, [&](std::size_t n) {
    const kernels::ParticleRange range = range_of(active.awake()[n]);
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const float speed = std::sqrt(p.v[0][i] * p.v[0][i] + p.v[1][i] * p.v[1][i] + p.v[2][i] * p.v[2][i]);
      const float x = static_cast<float>(dt) * air_drag[p.object[i]] * speed, kept = 1 / (1 + x + x * x);
      for (float* v : p.v) v[i] *= kept;
    }
  });
}

void Solver::State::particles_to_grid(const kernels::StepParams& params) {
  const kernels::ParticleView view = particles.view();
  parallel_for(active.scattering().size(), 1, [&](std::size_t i) {
    const std::size_t b = active.scattering()[i];
    if (held_dt[b] == params.dt) return;  // the tile is as it was
    kernels.mpm.p2g(params, materials.data(), view, range_of(b), grid.tile(b));
    held_dt[b] = active.of(b) == Activity::held ? params.dt : 0.f;
  });
}

void Solver::State::update_grid(const kernels::StepParams& params) {
  const auto scatters = [&](std::size_t b) { return active.of(b) != Activity::deep; };
  const std::vector<std::uint32_t>& updated = active.grid_blocks();
  const std::size_t colliders = setup.colliders.size();
  const std::size_t chunks = (updated.size() + kImpulseChunk - 1) / kImpulseChunk;
  chunk_impulses.assign(chunks * colliders, {});
  parallel_chunks(updated.size(), kImpulseChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::vector<kernels::ContactNodes> room;
    std::vector<double> sums(kernels::kImpulseParts * colliders);
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t g = updated[i];
      const float* tiles[kernels::kNeighbours];
      grid.tiles_around(g, scatters, tiles);
      kernels.mpm.reduce_tiles(tiles, grid.nodes(g));
      const auto& contacts = contacts_at(g, room);
      kernels.mpm.grid_update(params, contacts.data(), static_cast<int>(contacts.size()),
                              active.awake_nodes(g), grid.nodes(g), sums.data());
      for (const kernels::ContactNodes& contact : contacts) {
        const auto k = static_cast<std::size_t>(contact.collider);
        chunk_impulses[chunk * colliders + k] +=
            take_impulse(&sums[kernels::kImpulseParts * k], grid.coord(g), setup.dx);
      }
    }
  });
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    for (std::size_t k = 0; k < colliders; ++k) forces.impulse[k] += chunk_impulses[chunk * colliders + k];
  }
}

void Solver::State::grid_to_particles(const kernels::StepParams& params) {
  const kernels::ParticleView view = particles.view();
  parallel_for(active.awake().size(), 1, [&](std::size_t i) {
    const std::size_t b = active.awake()[i];
    const float* around[kernels::kNeighbours];
    alignas(64) float tile[kernels::kTileStride];
    grid.blocks_around(b, around);
    kernels.mpm.assemble_tile(around, tile);
    kernels.mpm.g2p(params, materials.data(), view, range_of(b), tile, &summaries[b]);
  });
  stop_at_thin_colliders(params.dt);
  summary = combine(summaries);
  plastic_work += static_cast<double>(summary.plastic_work) / work_quanta;
}

void Solver::State::note_rest(double dt) {
  bool changed = false;
  for (const std::uint32_t b : active.awake()) {
    float& calm = blocks.calm[b];
    const bool rested = calm >= rest.time;
    calm = is_quiet(summaries[b], setup.dx, rest.speed) ? calm + static_cast<float>(dt) : 0.f;
    changed = changed || rested != (calm >= rest.time);
  }
  if (changed) find_active();
}

// Whoever falls asleep stands still from now on; its summary is what its particles say, and stays.
void Solver::State::find_active() {
  const std::vector<std::uint32_t> asleep = active.find(blocks, grid, rest.time);
  held_dt.assign(blocks.size(), 0.f);
  parallel_for(asleep.size(), 4, [&](std::size_t i) {
    const std::size_t b = asleep[i];
    set_at_rest(particles.view(), range_of(b));
    kernels.mpm.summarise(materials.data(), particles.view(), range_of(b), &summaries[b]);
  });
  weigh_sleepers();
}

std::size_t Solver::State::asleep() const {
  std::size_t awake = 0;
  for (const std::uint32_t b : active.awake()) awake += blocks.begin[b + 1] - blocks.begin[b];
  return particles.size() - awake;
}

void Solver::State::summarise() {
  parallel_for(blocks.size(), 4, [&](std::size_t b) {
    kernels.mpm.summarise(materials.data(), particles.view(), range_of(b), &summaries[b]);
  });
  summary = combine(summaries);
}

kernels::StepParams Solver::State::step_params(double dt) const {
  kernels::StepParams params{};
  params.dt = static_cast<float>(dt);
  params.dx = static_cast<float>(setup.dx);
  params.inv_dx = static_cast<float>(1 / setup.dx);
  for (int axis = 0; axis < 3; ++axis) params.gravity_dt[axis] = static_cast<float>(setup.gravity[axis] * dt);
  params.mass_floor = mass_floor;
  params.work_quanta = work_quanta;
  return params;
}

void Solver::State::step(double dt) {
  for (Driven& d : driven) d.before = forces.impulse[d.collider];
  const kernels::StepParams params = step_params(dt);
  const auto done = [this](const char* stage) {
    if (after_stage) after_stage(stage);
  };
  if (summary.strayed) sort();
  moving = moving_colliders(setup.colliders, time, time + dt);
  if (!moving.empty()) wake_beside_colliders();
  done("sort");
  if (!air_drag.empty()) brake_in_air(dt);
  particles_to_grid(params);
  done("p2g");
  update_grid(params);
  forces.add_sleepers(dt);
  done("grid");
  grid_to_particles(params);
  done("g2p");
  particle_steps += particles.size() - asleep();
  note_rest(dt);
  note_driven(dt);
  reached = time += dt;
  ++steps;
  changed = false;
  check_stability(dt);
}

}  // namespace firn
