// SPDX-License-Identifier: MIT
// Everything that a simulation holds between two steps. Private to src/mpm: the rest of firn sees
// simulation.h.
#pragma once
#include <atomic>
#include <functional>
#include <utility>
#include <vector>

#include "kernels/table.h"
#include "src/mpm/block_grid.h"
#include "src/mpm/colliders.h"
#include "src/mpm/contact_forces.h"
#include "src/mpm/driven.h"
#include "src/mpm/frame.h"
#include "src/mpm/sleep.h"
#include "src/mpm/solver.h"
#include "src/mpm/thin_colliders.h"
#include "src/particles/blocks.h"
#include "src/particles/columns.h"
#include "src/particles/sort.h"

namespace firn {

// The energy that the scene can turn into speed, for the blow-up check.
struct EnergyBudget {
  double start_speed = 0;    // m/s, the fastest particle as placed
  double elastic_speed = 0;  // m/s, what round-off and a per cent of strain may give
  double top = 0;            // m, the highest particle as placed, against gravity
};

struct Solver::State {
  State(const kernels::KernelTable& table, SolverSetup scene)
      : kernels(table),
        front(front_direction(scene)),
        setup(in_frame(std::move(scene))),
        thin_indices(find_thin(setup.colliders, setup.dx)),
        forces(setup.colliders.size()) {}

  const kernels::KernelTable& kernels;
  Vec3 front;                                      // world: where metrics look for the front
  SolverSetup setup;                               // as seen from its frame, without the placed particles
  std::vector<kernels::MaterialParams> materials;  // index = particle column `object`
  EnergyBudget budget;
  std::vector<float> air_drag;  // 1/m, of each object; empty: none is braked by the air
  float mass_floor = 0;         // kg
  RestLimits rest{};

  ParticleColumns particles;
  ParticleBlocks blocks;
  BlockSorter sorter;
  BlockGrid grid;
  std::vector<kernels::BlockSummary> summaries;  // one an occupied block
  ActiveBlocks active;
  std::vector<float> held_dt;  // s, the dt with which the tile of a held block was made; 0: none

  std::vector<std::size_t> thin_indices;  // of the colliders whose particles are watched
  ContactForces forces;
  std::vector<Driven> driven;           // colliders that a program drives
  bool asking = false;                  // their drivers, which must not change anything
  std::vector<Impulse> chunk_impulses;  // of a step: one a collider a chunk of grid blocks
  std::vector<SleepingNodes> sleeping;  // of each grid block
  double plastic_work = 0;              // J, since the start
  double work_quanta = 0;               // 1/J

  double time = 0;                 // s
  std::atomic<double> reached{0};  // as `time`, for other threads
  std::uint64_t steps = 0;
  std::uint64_t particle_steps = 0;
  std::size_t left = 0;             // particles gone through the domain's boundary
  std::uint32_t next_id = 0;        // of the next particle that is placed
  std::size_t added = 0;            // snow objects that add() brought
  kernels::BlockSummary summary{};  // of all blocks, after the last step
  TimeStep last_step;
  bool changed = false;                // by particles that came or went, since the last step
  double last_stable_dt = 0;           // s, before the last step
  double bottom = 0;                   // m, below every particle until the next sort, against gravity
  Bounds reach;                        // m, around every particle until the next sort
  std::vector<MovingCollider> moving;  // during the step
  std::function<void(const char* stage)> after_stage;  // for benches, which time the stages; else empty

  // driven.cpp
  void require_idle() const;    // usage Error inside of a driver
  void ask_drivers();           // before a step, whose length is not known yet
  void note_driven(double dt);  // after it

  // change.cpp
  void add(PlacedSnow snow);
  std::size_t remove(const std::vector<std::uint32_t>& ids);
  void settle_anew();
  void require_sound() const;  // an unstable Error for a state that has blown up: it stays so

  // step.cpp
  void step(double dt);
  void checked_step(double dt);  // simulation.cpp
  kernels::StepParams step_params(double dt) const;
  void sort();
  void rebuild_grid();
  void wake_beside_colliders();
  void brake_in_air(double dt);
  void particles_to_grid(const kernels::StepParams& params);
  void update_grid(const kernels::StepParams& params);
  void grid_to_particles(const kernels::StepParams& params);
  void stop_at_thin_colliders(double dt);  // thin_colliders.cpp
  void note_rest(double dt);
  void find_active();
  void summarise();  // `summary` of the particles as they stand

  kernels::ParticleRange range_of(std::size_t b) const { return {blocks.begin[b], blocks.begin[b + 1]}; }

  // weigh_sleepers.cpp
  const std::vector<kernels::ContactNodes>& contacts_at(std::size_t grid_block,
                                                        std::vector<kernels::ContactNodes>& room) const;
  std::vector<SleepingNodes::Force> forces_on_sleepers(
      std::size_t grid_block, const std::vector<kernels::ContactNodes>& contacts) const;
  void weigh_sleepers();

  std::size_t asleep() const;  // particles
  std::size_t resident_bytes() const;

  // stability.cpp: throws an unstable Error that names step, particle and likely cause.
  void check_stability(double dt) const;
};

// placement.cpp: particles as placed, their order and the budget.
void place_particles(Solver::State& state);

bool is_driven(const Solver::State& state, std::size_t collider);
std::vector<DrivenCollider> driven_now(const Solver::State& state);  // in the scene's order

// Maxima and flags of all blocks.
kernels::BlockSummary combine(const std::vector<kernels::BlockSummary>& summaries);

// timestep.cpp: the longest stable step, never the fixed one of the scene.
TimeStep stable_limit(const Solver::State& state);

double height_against(const Vec3& gravity, const Vec3& x);  // m, 0 without gravity

}  // namespace firn
