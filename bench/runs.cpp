// SPDX-License-Identifier: MIT
#include "bench/runs.h"

#include <cstdio>

#include "bench/scene.h"

namespace firn::bench {

FirnRun::FirnRun(const kernels::KernelTable& kernels, SolverSetup setup) : state_(kernels, std::move(setup)) {
  place_particles(state_);
  state_.rebuild_grid();
  state_.summarise();
}

bool FirnRun::step(double dt, bool counts, std::string& why) {
  const TimeStep limit = stable_limit(state_);
  if (dt > limit.dt) {
    char text[160];
    std::snprintf(text, sizeof text, "firn's stable limit is %.3g s: %s", limit.dt, limit.cause.c_str());
    why = text;
    return false;
  }
  const auto begin = Clock::now();
  auto since = begin;
  state_.after_stage = [&](const char* stage) {
    const auto now = Clock::now();
    if (counts) seconds_of(stage) += std::chrono::duration<double>(now - since).count();
    since = now;
  };
  try {
    state_.step(dt);
  } catch (const Error& error) {
    why = error.what();
    return false;
  }
  if (!counts) return true;
  tally_.seconds += std::chrono::duration<double>(Clock::now() - begin).count();
  tally_.particle_steps += static_cast<double>(state_.particles.size());
  tally_.clamped += state_.summary.clamped;
  return true;
}

double& FirnRun::seconds_of(const char* stage) {
  for (auto& [name, seconds] : seconds_) {
    if (name == stage) return seconds;
  }
  return seconds_.emplace_back(stage, 0.0).second;
}

Json FirnRun::stages() const {
  Json ns = Json::object();
  double other = tally_.seconds;
  for (const auto& [stage, seconds] : seconds_) {
    ns[stage] = seconds * 1e9 / tally_.particle_steps;
    other -= seconds;
  }
  ns["other"] = other * 1e9 / tally_.particle_steps;
  return ns;
}

NaiveRun::NaiveRun(const SolverSetup& setup, bool stop_early)
    : simulation_(setup, stop_early), dx_(setup.dx), allowed_speed_(2 * scene_speed(setup)) {}

bool NaiveRun::step(double dt, bool counts, std::string& why) {
  const auto begin = std::chrono::steady_clock::now();
  simulation_.step(static_cast<float>(dt));
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  const double speed = simulation_.max_speed();
  if (!(speed < allowed_speed_ && speed * dt < dx_)) {
    char text[120];
    std::snprintf(text, sizeof text, "the baseline has a particle at %.3g m/s, %.3g at most are possible",
                  speed, allowed_speed_ / 2);
    why = text;
    return false;
  }
  if (!counts) return true;
  tally_.seconds += seconds.count();
  tally_.particle_steps += static_cast<double>(simulation_.particles().size());
  tally_.clamped += static_cast<double>(simulation_.clamped());
  return true;
}

}  // namespace firn::bench
