// SPDX-License-Identifier: MIT
// One scene stepped by firn and by the baseline at the same fixed dt, each with a clock beside it. They take
// turns of some steps, so that both see the machine in the same mood.
#pragma once
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "bench/naive.h"
#include "bench/report.h"
#include "firn/error.h"
#include "src/mpm/state.h"

namespace firn::bench {

inline constexpr int kTurn = 20;  // steps that one side takes before it is the other's turn

// What run() gives at the first dt at which it gives something, halving dt after each nothing. Errors:
// unstable, below 1e-7 s.
template <class Run>
auto halve_until_stable(double& dt, Run&& run) {
  for (; dt > 1e-7; dt /= 2) {
    if (auto runs = run()) return std::move(*runs);
  }
  throw Error(ErrorCode::unstable, "", "no dt above 1e-7 s is stable");
}

// What was counted over the timed steps.
struct Tally {
  double seconds = 0;
  double particle_steps = 0;
  double clamped = 0;

  double rate() const { return particle_steps / seconds; }
  double clamped_share() const { return clamped / particle_steps; }
};

class FirnRun {
 public:
  FirnRun(const kernels::KernelTable& kernels, SolverSetup setup);

  // False when dt is longer than firn's stable limit, or the simulation blew up (`why` says it).
  bool step(double dt, bool counts, std::string& why);

  const Tally& tally() const { return tally_; }
  // ns a particle-step; "other" is what step() does beside the named stages.
  Json stages() const;
  const Solver::State& state() const { return state_; }
  Solver::State& state() { return state_; }

 private:
  using Clock = std::chrono::steady_clock;
  double& seconds_of(const char* stage);
  Solver::State state_;
  Tally tally_;
  std::vector<std::pair<std::string, double>> seconds_;  // of each stage, in their order
};

class NaiveRun {
 public:
  NaiveRun(const SolverSetup& setup, bool stop_early);

  // False when a particle is not finite, crosses a cell in a step or is faster than the scene's energy
  // allows.
  bool step(double dt, bool counts, std::string& why);

  const Tally& tally() const { return tally_; }

 private:
  NaiveSimulation simulation_;
  double dx_, allowed_speed_;
  Tally tally_;
};

}  // namespace firn::bench
