// SPDX-License-Identifier: MIT
// firn-bench sim: how many particle-steps a second, how much of what the core could do, how much faster than
// the baseline. Everything a step does is in the time: sorting, dt's maxima, the blow-up check.
//
// dt is fixed. A run in which it exceeds firn's own stable limit (docs/physics.md), or in which either side
// blows up, is given up and begun again with half of it; firn goes first and alone, the baseline being slow.
#include "bench/sim.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include "bench/counts.h"
#include "bench/machine.h"
#include "bench/report.h"
#include "bench/runs.h"
#include "bench/scene.h"
#include "src/core/isa.h"

namespace firn::bench {

namespace {

struct Runs {
  std::unique_ptr<FirnRun> firn;
  std::unique_ptr<NaiveRun> naive;  // null without baseline
};

// Nothing when dt is too long; says why on stderr.
std::optional<Runs> run_at(double dt, const SimOptions& options, bool naive,
                           const kernels::KernelTable& kernels) {
  Runs runs;
  {
    SolverSetup setup = bench_scene(options.scene, options.particles);
    if (naive) runs.naive = std::make_unique<NaiveRun>(setup, options.stop_early);
    runs.firn = std::make_unique<FirnRun>(kernels, std::move(setup));
  }
  std::string why;
  const auto turn = [&](auto& run, int first) {
    for (int step = first; step < std::min(first + kTurn, options.steps); ++step) {
      if (!run.step(dt, step >= options.steps / 2, why)) {
        std::fprintf(stderr, "dt = %g s is too long at step %d (%s): halved\n", dt, step, why.c_str());
        return false;
      }
    }
    return true;
  };
  for (int first = 0; first < options.steps; first += kTurn) {
    if (!turn(*runs.firn, first)) return std::nullopt;
    if (runs.naive && !turn(*runs.naive, first)) return std::nullopt;
  }
  return runs;
}

Json report_of(const SimOptions& options, const kernels::KernelTable& kernels, double dt, const Runs& runs) {
  const Tally& firn = runs.firn->tally();
  const Limits limits = measure_limits(kernels.isa);
  const double flops = kStepFlops + kClampFlops * firn.clamped_share();
  const auto& state = runs.firn->state();
  Json json = {
      {"particle_steps_per_second", firn.rate()},
      {"naive_particle_steps_per_second", nullptr},
      {"ratio_to_naive", nullptr},
      {"threads", options.threads},
      {"isa", kernels.isa},
      {"bytes_per_particle",
       static_cast<double>(state.resident_bytes()) / static_cast<double>(state.particles.size())},
      {"stages", runs.firn->stages()},
      {"flop_floor_share", flops / (limits.flops * options.threads) * firn.rate()},
      {"fma_peak", limits.flops},
      {"scene", options.scene},
      {"particles", state.particles.size()},
      {"steps", options.steps},
      {"dt", dt},
      {"clamped_share", firn.clamped_share()},
  };
  if (runs.naive) {
    json["naive_particle_steps_per_second"] = runs.naive->tally().rate();
    json["ratio_to_naive"] = firn.rate() / runs.naive->tally().rate();
    json["naive_clamped_share"] = runs.naive->tally().clamped_share();
    json["naive_svd"] = options.stop_early ? "converged" : "five sweeps";
  }
  add_provenance(json);
  return json;
}

void print(const Json& r) {
  const auto number = [&](const char* key) { return r[key].get<double>(); };
  std::printf("%s: %.0f particles, %d threads, %s, %s\n", r["scene"].get<std::string>().c_str(),
              number("particles"), r["threads"].get<int>(), r["isa"].get<std::string>().c_str(),
              r["machine"]["cpu"].get<std::string>().c_str());
  std::printf("dt %g s, means of the last %d of %d steps\n", number("dt"),
              r["steps"].get<int>() - r["steps"].get<int>() / 2, r["steps"].get<int>());
  const double rate = number("particle_steps_per_second");
  std::printf("%.2f M particle-steps/s, %.1f ns a particle-step:", rate * 1e-6, 1e9 / rate);
  for (const auto& [stage, ns] : r["stages"].items()) {
    std::printf(" %s %.1f", stage.c_str(), ns.get<double>());
  }
  std::printf(
      "\n%.1f %% of the flop floor (FMA peak %.0f GF/s a core), %.0f bytes a particle, %.2f %% clamped\n",
      100 * number("flop_floor_share"), 1e-9 * number("fma_peak"), number("bytes_per_particle"),
      100 * number("clamped_share"));
  if (r["ratio_to_naive"].is_null()) return;
  std::printf("%.2f times the baseline: %.2f M particle-steps/s on one thread, SVD %s, %.2f %% clamped\n",
              number("ratio_to_naive"), 1e-6 * number("naive_particle_steps_per_second"),
              r["naive_svd"].get<std::string>().c_str(), 100 * number("naive_clamped_share"));
}

}  // namespace

void run_sim(const SimOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(options.threads));
  double dt = options.dt;
  Runs runs = halve_until_stable(dt, [&] { return run_at(dt, options, false, kernels); });
  if (options.naive) runs = halve_until_stable(dt, [&] { return run_at(dt, options, true, kernels); });
  const Json report = report_of(options, kernels, dt, runs);
  print(report);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
