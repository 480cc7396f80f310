// SPDX-License-Identifier: MIT
// What a scene will cost, without running it: it is read, its snow is placed, and the numbers are printed on
// stdout.
#include <cmath>
#include <cstdio>
#include <string>

#include "src/app/commands.h"
#include "src/app/report.h"
#include "src/core/isa.h"
#include "src/graph/frame_graph.h"
#include "src/mpm/simulation.h"
#include "src/render/renderer.h"
#include "src/scene/scene.h"

namespace firn {
namespace {

constexpr int kSlots = 3;

void line(const std::string& name, const std::string& value) {
  std::printf("%-16s%s\n", name.c_str(), value.c_str());
}

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

void print_snow(const SimulationSetup& setup) {
  std::size_t particles = 0;
  double mass = 0;
  for (const auto& snow : setup.snow) {
    particles += snow.position.size();
    mass += static_cast<double>(snow.position.size()) * snow.particle_mass();
  }
  line("particles", grouped(particles) + text(", %.4g kg", mass));
  for (const auto& snow : setup.snow) {
    const auto count = static_cast<double>(snow.position.size());
    line("  " + snow.name, grouped(snow.position.size()) +
                               text(", %.4g kg, %.4g m3, %.4g mg a particle", count * snow.particle_mass(),
                                    count * snow.particle_volume, 1e6 * snow.particle_mass()));
  }
}

void print_time(const SceneConfig& scene, const SimulationSetup& setup, const TimeStep& step) {
  const double frame = scene.time.speed / scene.time.fps;
  const double dt = setup.fixed_dt.value_or(step.dt);
  line("time step", text("%.3g s", dt) + (setup.fixed_dt ? ", fixed by the scene; the stable bound is " +
                                                               text("%.3g s", step.dt)
                                                         : std::string(", limited by ") + step.cause));
  line("frames",
       text("%d of %.4g s: about %.0f steps a frame, ", scene.time.frames, frame, std::ceil(frame / dt)) +
           grouped(static_cast<std::uint64_t>(std::ceil(frame / dt) * (scene.time.frames - 1))) + " in all");
}

void print_memory(const SceneConfig& scene, const Simulation& simulation) {
  constexpr double kSnapshotBytes = 38;  // a particle: x, v, density, volume0, id, object
  const auto particles = static_cast<double>(simulation.particle_count());
  const double snow = static_cast<double>(simulation.resident_bytes());
  const double snapshots = kSlots * kSnapshotBytes * particles;
  const double films = kSlots * 12.0 * scene.image.width * scene.image.height;
  line("memory",
       mebibytes(snow + snapshots + films) + text(" at the start: simulation %s (%.0f bytes a particle),",
                                                  mebibytes(snow).c_str(), snow / std::max(particles, 1.0)));
  line("", text("%d snapshots %s, films %s", kSlots, mebibytes(snapshots).c_str(), mebibytes(films).c_str()));
}

}  // namespace

ExitCode check_command(const Options& options) {
  const auto& kernels = choose_kernels(options.isa);
  const SceneConfig scene = read_scene(options.target, options.reading());
  const Renderer renderer(kernels, build_render(scene));  // refuses what cannot be rendered
  const SimulationSetup setup = build_simulation(scene, options.force);
  const Simulation simulation(kernels, setup);
  line("scene", scene.name + " (" + scene.file + (options.quick ? ", quick size)" : ")"));
  print_snow(setup);
  line("grid", text("dx %.4g m, ", setup.dx) + grouped(simulation.grid_blocks()) +
                   " blocks of 4x4x4 nodes, growing with the snow");
  print_time(scene, setup, simulation.stable_step());
  print_memory(scene, simulation);
  line("image", text("%dx%d, %d samples, %d bounces", scene.image.width, scene.image.height,
                     scene.image.samples, scene.image.max_bounces));
  return ExitCode::ok;
}

}  // namespace firn
