// SPDX-License-Identifier: MIT
// firn-bench resting: what a step costs when the snow has come to rest but for a tenth of it, with sleep and
// without. A packed bed lies at rest on the floor; beside it the impact of `sim` happens to a ball of a tenth
// of the particles. Everything a step does is in the time.
//
// That the bed rests is brought about with damping, which only this program has, and which ends before
// anything is timed. Both sides then take the same steps from the same particles, in turns.
#include "bench/resting.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "bench/report.h"
#include "bench/runs.h"
#include "bench/scene.h"
#include "firn/error.h"
#include "src/core/isa.h"
#include "src/core/parallel.h"

namespace firn::bench {

namespace {

using State = Solver::State;

constexpr std::uint32_t kBed = 0, kBall = 1;
constexpr float kKept = 0.98f;  // of the bed's v and C after a step of damping
constexpr int kMostDamped = 10000;

// The ball stands on the bed's right, a bed's width away.
SolverSetup bed_and_ball(std::size_t particles) {
  SolverSetup setup = bench_scene("settled", particles - particles / 10);
  setup.snow.push_back(bench_scene("impact", particles / 10).snow.front());
  double width = 0;
  for (const Vec3& x : setup.snow[kBed].position) width = std::max(width, x.x());
  for (Vec3& x : setup.snow[kBall].position) x += Vec3(2 * width, 0, width / 2);
  return setup;
}

template <class F>
void for_each_particle(State& s, F&& f) {
  parallel_chunks(s.particles.size(), 16384, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) f(s.particles.view(), i);
  });
}

// Steps until all snow sleeps; the ball is held where it is.
void bring_to_rest(State& s, double dt) {
  for (int step = 0; s.asleep() < s.particles.size(); ++step) {
    if (step == kMostDamped) throw Error(ErrorCode::unstable, "", "the bed does not come to rest");
    s.last_stable_dt = stable_limit(s).dt;
    s.step(std::min(dt, s.last_stable_dt));
    for_each_particle(s, [](const kernels::ParticleView& p, std::size_t i) {
      const float kept = p.object[i] == kBall ? 0.f : kKept;
      for (float* column : p.v) column[i] *= kept;
      for (float* column : p.C) column[i] *= kept;
    });
  }
}

void throw_ball(State& s, const Vec3& velocity) {
  for_each_particle(s, [&](const kernels::ParticleView& p, std::size_t i) {
    if (p.object[i] != kBall) return;
    for (int axis = 0; axis < 3; ++axis) p.v[axis][i] = static_cast<float>(velocity[axis]);
  });
  for (std::size_t b = 0; b < s.blocks.size(); ++b) {
    if (s.particles.view().object[s.blocks.begin[b]] == kBall) s.blocks.calm[b] = 0;
  }
}

void copy_particles(const State& from, State& to) {
  to.particles.allocate(from.particles.size());
  for (std::size_t k = 0; k < kColumns; ++k) {
    std::memcpy(to.particles.column(k), from.particles.column(k),
                from.particles.size() * sizeof(std::uint32_t));
  }
  to.blocks = from.blocks;
  to.rebuild_grid();
  to.summarise();
}

struct Runs {
  std::unique_ptr<FirnRun> asleep, awake;
  double asleep_share = 0;  // mean over the timed steps
};

// Nothing when dt is too long; says why on stderr.
std::optional<Runs> run_at(double dt, const RestingOptions& options, const SolverSetup& setup,
                           const State& start) {
  Runs runs;
  const auto make = [&](bool sleep) {
    SolverSetup own = setup;
    own.sleep = sleep;
    auto run = std::make_unique<FirnRun>(start.kernels, std::move(own));
    copy_particles(start, run->state());
    return run;
  };
  runs.asleep = make(true);
  runs.awake = make(false);
  const int timed_from = options.steps / 2;
  std::string why;
  for (int first = 0; first < options.steps; first += kTurn) {
    for (FirnRun* run : {runs.asleep.get(), runs.awake.get()}) {
      for (int step = first; step < std::min(first + kTurn, options.steps); ++step) {
        if (!run->step(dt, step >= timed_from, why)) {
          std::fprintf(stderr, "dt = %g s is too long at step %d (%s): halved\n", dt, step, why.c_str());
          return std::nullopt;
        }
        if (run != runs.asleep.get() || step < timed_from) continue;
        runs.asleep_share += static_cast<double>(run->state().asleep()) /
                             static_cast<double>(run->state().particles.size()) /
                             (options.steps - timed_from);
      }
    }
  }
  return runs;
}

Json report_of(const RestingOptions& options, const char* isa, double dt, const Runs& runs) {
  const Tally &asleep = runs.asleep->tally(), &awake = runs.awake->tally();
  Json json = {
      {"ratio", asleep.rate() / awake.rate()},
      {"asleep_share", runs.asleep_share},
      {"ns_with_sleep", 1e9 / asleep.rate()},
      {"ns_without", 1e9 / awake.rate()},
      {"stages_with_sleep", runs.asleep->stages()},
      {"stages_without", runs.awake->stages()},
      {"threads", options.threads},
      {"isa", isa},
      {"particles", runs.asleep->state().particles.size()},
      {"steps", options.steps},
      {"dt", dt},
  };
  add_provenance(json);
  return json;
}

void print_side(const char* name, double ns, const Json& stages) {
  std::printf("%s %.2f ns a particle-step:", name, ns);
  for (const auto& [stage, stage_ns] : stages.items()) {
    std::printf(" %s %.2f", stage.c_str(), stage_ns.get<double>());
  }
  std::printf("\n");
}

void print(const Json& r) {
  const auto number = [&](const char* key) { return r[key].get<double>(); };
  std::printf("resting: %.0f particles, a tenth of them in motion, %d threads, %s, %s\n", number("particles"),
              r["threads"].get<int>(), r["isa"].get<std::string>().c_str(),
              r["machine"]["cpu"].get<std::string>().c_str());
  const int steps = r["steps"].get<int>();
  std::printf("dt %g s, means of the last %d of %d steps; %.1f %% of the particles slept\n", number("dt"),
              steps - steps / 2, steps, 100 * number("asleep_share"));
  print_side("with sleep", number("ns_with_sleep"), r["stages_with_sleep"]);
  print_side("without   ", number("ns_without"), r["stages_without"]);
  std::printf("%.2f times cheaper with sleep\n", number("ratio"));
}

}  // namespace

void run_resting(const RestingOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(options.threads));
  SolverSetup setup = bed_and_ball(options.particles);
  const Vec3 velocity = setup.snow[kBall].velocity.front();
  setup.sleep = true;
  FirnRun start(kernels, setup);
  bring_to_rest(start.state(), options.dt);
  throw_ball(start.state(), velocity);
  double dt = options.dt;
  const Runs runs = halve_until_stable(dt, [&] { return run_at(dt, options, setup, start.state()); });
  const Json report = report_of(options, kernels.isa, dt, runs);
  print(report);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
