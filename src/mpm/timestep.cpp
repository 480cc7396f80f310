// SPDX-License-Identifier: MIT
// The longest stable step from what G2P saw: the stiffest particle's elastic wave, the fastest particle, the
// strongest velocity gradient; and from the colliders that will move in it. Hardening is exponential (packed
// snow is up to 7 times as fast as fresh), so it is asked anew before every step.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "src/mpm/colliders.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// A particle may cross this part of a cell in a step (half is the limit of the stencil's validity;
// accelerations within the step need some of it), and F may change by this factor.
constexpr double kSpeedCourant = 0.4;
constexpr double kRateCourant = 0.5;
constexpr double kColliderCourant = 0.25;  // the part of a cell that a collider may cross

const char* snow_state(const Solver::State& state, double wave_speed) {
  double fresh = 0;
  bool snow = false;
  for (const kernels::MaterialParams& m : state.materials) {
    fresh = std::max(fresh, std::sqrt((m.lambda + 2.0 * m.mu) * m.inverse_density));
    snow = snow || m.kind == kernels::kKindOf<kernels::Snow>;
  }
  if (!snow) return "";
  return wave_speed > 1.05 * fresh ? "packed snow, " : "fresh snow, ";
}

}  // namespace

kernels::BlockSummary combine(const std::vector<kernels::BlockSummary>& summaries) {
  kernels::BlockSummary all{};
  std::int64_t clamped = 0;
  for (const kernels::BlockSummary& s : summaries) {
    all.speed2 = std::max(all.speed2, s.speed2);
    all.wave2 = std::max(all.wave2, s.wave2);
    all.rate2 = std::max(all.rate2, s.rate2);
    all.strayed |= s.strayed;
    all.not_finite |= s.not_finite;
    clamped += s.clamped;
    all.plastic_work += s.plastic_work;
  }
  all.clamped = static_cast<std::int32_t>(std::min<std::int64_t>(clamped, INT32_MAX));  // benches alone ask
  return all;
}

TimeStep stable_limit(const Solver::State& state) {
  const double dx = state.setup.dx;
  const double wave = std::sqrt(state.summary.wave2);
  const double speed = std::sqrt(state.summary.speed2);
  const double rate = std::sqrt(state.summary.rate2);
  TimeStep limit{state.setup.max_dt, "the longest step allowed"};
  const auto consider = [&](double dt, const char* format, auto... values) {
    if (!(dt < limit.dt)) return;
    char text[96];
    std::snprintf(text, sizeof text, format, values...);
    limit = {dt, text};
  };
  consider(kElasticCourant * dx / wave, "elastic wave (%s%.3g m/s)", snow_state(state, wave), wave);
  consider(kSpeedCourant * dx / speed, "particle speed (%.3g m/s)", speed);
  consider(kRateCourant / rate, "velocity gradient (%.3g 1/s)", rate);
  for (const Collider& collider : state.setup.colliders) {
    if (collider.motion.empty()) continue;
    const double v = speed_where_snow_is(collider, state.reach, state.time, state.time + limit.dt);
    consider(kColliderCourant * dx / v, "collider speed (%s, %.3g m/s)", collider.name.c_str(), v);
  }
  for (const Driven& d : state.driven) {  // not beyond the motion that its driver's velocity was made into
    const double left = 0.5 * (d.end.time - state.time);
    if (left > 0) consider(left, "collider turning (%s)", state.setup.colliders[d.collider].name.c_str());
  }
  return limit;
}

}  // namespace firn
