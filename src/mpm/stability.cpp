// SPDX-License-Identifier: MIT
// The blow-up check after every step: a NaN or an infinity anywhere, or a speed that the scene has no energy
// for, stops the run with the step, the particle and the likely cause. Looked at through BlockSummary, so it
// costs nothing until something is wrong.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "firn/error.h"
#include "src/mpm/colliders.h"
#include "src/mpm/state.h"

namespace firn {

namespace {

// Colliders may have lifted the snow by the way they went, and thrown it at twice their speed.
double allowed_speed(const Solver::State& state) {
  const EnergyBudget& budget = state.budget;
  double lift = 0, throw_speed = 0;
  for (const Driven& d : state.driven) {
    lift += d.longest_way;
    throw_speed = std::max(throw_speed, 2 * d.top_speed);
  }
  for (std::size_t k = 0; k < state.setup.colliders.size(); ++k) {
    const Collider& c = state.setup.colliders[k];
    if (c.motion.empty() || is_driven(state, k)) continue;
    lift += way_where_snow_is(c, state.reach, 0, state.time);
    throw_speed = std::max(throw_speed, 2 * speed_where_snow_is(c, state.reach, 0, state.time));
  }
  const double fall = 2 * state.setup.gravity.norm() * std::max(0.0, budget.top + lift - state.bottom);
  return 2 * std::sqrt(budget.start_speed * budget.start_speed + budget.elastic_speed * budget.elastic_speed +
                       throw_speed * throw_speed + fall);
}

struct Culprit {
  std::uint32_t id = UINT32_MAX;
  std::uint32_t object = 0;
};

// Of the particles with a value that is not finite, or else of the fastest ones, the one with the lowest id.
Culprit find_culprit(const kernels::ParticleView& p, std::size_t count, bool not_finite, float speed2) {
  Culprit culprit;
  for (std::size_t i = 0; i < count; ++i) {
    const double v2 = std::pow(p.v[0][i], 2) + std::pow(p.v[1][i], 2) + std::pow(p.v[2][i], 2);
    double all = v2 + p.Jp[i];
    for (int k = 0; k < 9; ++k) all += p.C[k][i] + p.F[k][i];
    const bool guilty = not_finite ? !(std::abs(all) < 1e38) : v2 > 0.9999 * speed2;
    if (guilty && p.id[i] < culprit.id) culprit = {p.id[i], p.object[i]};
  }
  return culprit;
}

std::string likely_cause(const Solver::State& state, double dt) {
  char text[200];
  const double stable = std::min(state.last_stable_dt, state.setup.max_dt);
  if (state.setup.fixed_dt && dt > 1.001 * stable) {
    std::snprintf(text, sizeof text, "the fixed dt of %.3g s is longer than the stable %.3g s", dt, stable);
    return text;
  }
  std::snprintf(
      text, sizeof text,
      "snow placed overlapping or deep inside a collider, or material parameters far from snow's (dt %.3g s)",
      dt);
  return text;
}

}  // namespace

void Solver::State::check_stability(double dt) const {
  const double speed = std::sqrt(summary.speed2);
  const double allowed = setup.check_energy_bound ? allowed_speed(*this) : HUGE_VAL;
  const double cells = speed * dt / setup.dx;
  char trouble[160];
  if (summary.not_finite) {
    std::snprintf(trouble, sizeof trouble, "holds a value that is not a number");
  } else if (speed > allowed) {
    std::snprintf(trouble, sizeof trouble,
                  "moves at %.4g m/s, more than twice what the scene's energy allows (%.4g m/s)", speed,
                  allowed / 2);
  } else if (cells >= 1) {  // the sort could not follow
    std::snprintf(trouble, sizeof trouble, "crosses %.3g cells in one step, at %.4g m/s", cells, speed);
  } else {
    return;
  }
  const Culprit culprit =
      find_culprit(particles.view(), particles.size(), summary.not_finite, summary.speed2);
  const std::string& name = setup.snow.empty() ? std::string() : setup.snow[culprit.object].name;
  char text[640];
  std::snprintf(text, sizeof text, "unstable at step %llu, t = %.6g s: particle %u%s%s %s; likely cause: %s",
                static_cast<unsigned long long>(steps), time, culprit.id, name.empty() ? "" : " of ",
                name.c_str(), trouble, likely_cause(*this, dt).c_str());
  throw Error(ErrorCode::unstable, "", text);
}

}  // namespace firn
