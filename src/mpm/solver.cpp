// SPDX-License-Identifier: MIT
#include "src/mpm/solver.h"

#include <algorithm>
#include <cmath>

#include "firn/error.h"
#include "src/mpm/state.h"

namespace firn {

Solver::Solver(const kernels::KernelTable& kernels, SolverSetup setup)
    : state_(std::make_unique<State>(kernels, std::move(setup))) {
  place_particles(*state_);
  state_->rebuild_grid();
  state_->summarise();
}

Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;

bool Solver::advance_to(double time, const std::stop_token& stop) {
  State& s = *state_;
  s.require_idle();
  if (s.time < time) s.forces.begin_if_complete(s.time);
  while (s.time < time) {
    if (stop.stop_requested()) return false;
    s.ask_drivers();
    const TimeStep limit = stable_step();
    // The rest is cut into equal steps, so that none is tiny. A hair's breadth is no reason for one more.
    const double steps = std::max(1.0, std::ceil((time - s.time) / limit.dt - 1e-6));
    const double end = steps == 1 ? time : s.time + (time - s.time) / steps;
    if (!(end > s.time))
      throw Error(ErrorCode::unstable, "", "no step is short enough for the " + limit.cause);
    s.last_step.cause = limit.cause;
    s.checked_step(end - s.time);
    s.reached = s.time = end;
  }
  s.forces.complete = true;
  return true;
}

void Solver::step(double dt) {
  if (!(dt > 0)) throw Error(ErrorCode::usage, "", "a step needs dt > 0");
  state_->require_idle();
  state_->ask_drivers();
  state_->forces.begin(state_->time);
  state_->checked_step(dt);
  state_->forces.complete = true;
}

void Solver::State::checked_step(double dt) {
  require_sound();
  last_stable_dt = stable_limit(*this).dt;
  last_step.dt = dt;
  step(dt);
}

double Solver::stable_advance() {
  state_->require_idle();
  state_->ask_drivers();
  const TimeStep limit = stable_step();
  if (!(state_->time + limit.dt > state_->time))
    throw Error(ErrorCode::unstable, "", "no step is short enough for the " + limit.cause);
  state_->last_step.cause = limit.cause;
  state_->forces.begin(state_->time);
  state_->checked_step(limit.dt);
  state_->forces.complete = true;
  return limit.dt;
}

std::vector<Collider> Solver::colliders_now() const {
  std::vector<Collider> colliders = state_->setup.colliders;
  for (Collider& c : colliders) {
    c.shape.pose = c.motion.pose(c.shape.pose, state_->time);
    if (const auto& frame = state_->setup.frame) {
      c.shape.pose = {frame->rotation * c.shape.pose.rotation, frame->to_world(c.shape.pose.translation)};
    }
  }
  return colliders;
}

double Solver::time() const { return state_->time; }
double Solver::reached() const { return state_->reached; }

TimeStep Solver::stable_step() const {
  if (state_->setup.fixed_dt) return {*state_->setup.fixed_dt, "the scene's fixed dt"};
  return stable_limit(*state_);
}

std::size_t Solver::particle_count() const { return state_->particles.size(); }
std::size_t Solver::grid_blocks() const { return state_->grid.size(); }
std::uint64_t Solver::particle_steps() const { return state_->particle_steps; }

std::size_t Solver::resident_bytes() const { return state_->resident_bytes(); }

std::size_t Solver::State::resident_bytes() const {
  return particles.resident_bytes() + blocks.resident_bytes() + sorter.resident_bytes() +
         grid.resident_bytes() + summaries.capacity() * sizeof(kernels::BlockSummary) +
         active.resident_bytes() + held_dt.capacity() * sizeof(float) +
         chunk_impulses.capacity() * sizeof(double) + sleeping.capacity() * sizeof(SleepingNodes);
}

}  // namespace firn
