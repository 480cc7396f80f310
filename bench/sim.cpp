// SPDX-License-Identifier: MIT
// A ball of snow, 8 particles a cell, dx = 1/128 m, two cells above a floor, thrown at it with 10 m/s: early
// steps are rigid, late ones break and pack. The stages of Simulation::State are called as step.cpp does,
// with a clock between.
#include "bench/sim.h"

#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "src/core/error.h"
#include "src/core/isa.h"
#include "src/mpm/state.h"

namespace firn::bench {

namespace {

constexpr double kDx = 1.0 / 128;  // m
constexpr double kDt = 1e-4;       // s, at most

SimulationSetup falling_ball(std::size_t particles) {
  const double h = kDx / 2;  // spacing
  const double radius = h * std::cbrt(3.0 * static_cast<double>(particles) / (4 * M_PI));
  const Vec3 center(0, radius + 2 * kDx, 0);
  PlacedSnow snow;
  snow.name = "ball";
  snow.particle_volume = h * h * h;
  snow.particle_mass = snow.material.density * snow.particle_volume;
  const int n = static_cast<int>(std::ceil(radius / h)) + 1;
  for (int i = -n; i < n; ++i) {
    for (int j = -n; j < n; ++j) {
      for (int k = -n; k < n; ++k) {
        const Vec3 x = h * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (x.norm() < radius) snow.position.push_back(center + x);
      }
    }
  }
  snow.velocity.assign(snow.position.size(), Vec3(0, -10, 0));
  SimulationSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(std::move(snow));
  Collider floor;
  floor.shape.form = HalfSpace{};
  floor.friction = 0.5;
  setup.colliders.push_back(floor);
  return setup;
}

struct Stages {
  double sort = 0, p2g = 0, grid = 0, g2p = 0;  // s
  double total() const { return sort + p2g + grid + g2p; }
};

struct Figures {
  Stages stages;
  double particle_steps = 0, clamped = 0, bytes_per_particle = 0;
  std::size_t particles = 0;
};

void timed_step(Simulation::State& state, double dt, Stages& stages) {
  using Clock = std::chrono::steady_clock;
  const auto timed = [](double& seconds, auto&& stage) {
    const auto begin = Clock::now();
    stage();
    seconds += std::chrono::duration<double>(Clock::now() - begin).count();
  };
  const kernels::StepParams params = state.step_params(dt);
  timed(stages.sort, [&] {
    if (state.summary.strayed) state.sort();
  });
  timed(stages.p2g, [&] { state.particles_to_grid(params); });
  timed(stages.grid, [&] { state.update_grid(params); });
  timed(stages.g2p, [&] { state.grid_to_particles(params); });
}

Figures measure(const kernels::KernelTable& kernels, const SimOptions& options) {
  Simulation::State state(kernels, falling_ball(options.particles));
  place_particles(state);
  state.rebuild_grid();
  state.summarise();
  Figures figures;
  for (int step = 0; step < options.steps; ++step) {
    Stages ignored;
    const bool counts = step >= options.steps / 2;
    timed_step(state, std::min(kDt, stable_limit(state).dt), counts ? figures.stages : ignored);
    if (!counts) continue;
    figures.particle_steps += static_cast<double>(state.particles.size());
    figures.clamped += state.summary.clamped;
  }
  figures.particles = state.particles.size();
  figures.clamped /= figures.particle_steps;
  figures.bytes_per_particle =
      static_cast<double>(state.resident_bytes()) / static_cast<double>(figures.particles);
  return figures;
}

std::string cpu_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

void write_json(const SimOptions& options, const char* isa, const Figures& f) {
  const double ns = 1e9 / f.particle_steps;
  const nlohmann::json json = {
      {"particle_steps_per_second", f.particle_steps / f.stages.total()},
      {"particles", f.particles},
      {"threads", options.threads},
      {"isa", isa},
      {"steps", options.steps},
      {"bytes_per_particle", f.bytes_per_particle},
      {"clamped_share", f.clamped},
      {"stages",
       {{"sort", f.stages.sort * ns},
        {"p2g", f.stages.p2g * ns},
        {"grid", f.stages.grid * ns},
        {"g2p", f.stages.g2p * ns}}},
      {"machine", {{"cpu", cpu_name()}, {"cores", std::thread::hardware_concurrency()}}},
      {"compiler", __VERSION__},
  };
  std::ofstream out(options.json);
  out << json.dump(2) << '\n';
  if (!out) throw Error(ExitCode::io, options.json, "cannot be written");
}

}  // namespace

void run_sim(const SimOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(options.threads));
  const Figures f = measure(kernels, options);
  const double ns = 1e9 / f.particle_steps;
  std::printf("%zu particles, %d threads, %s, %s\n", f.particles, options.threads, kernels.isa,
              cpu_name().c_str());
  std::printf("%.2f M particle-steps/s, %.1f ns a particle-step: sort %.1f, P2G %.1f, grid %.1f, G2P %.1f\n",
              f.particle_steps / f.stages.total() * 1e-6, f.stages.total() * ns, f.stages.sort * ns,
              f.stages.p2g * ns, f.stages.grid * ns, f.stages.g2p * ns);
  std::printf("%.0f bytes a particle, %.1f %% of particles clamped a step\n", f.bytes_per_particle,
              100 * f.clamped);
  if (!options.json.empty()) write_json(options, kernels.isa, f);
}

}  // namespace firn::bench
