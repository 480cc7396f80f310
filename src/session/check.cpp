// SPDX-License-Identifier: MIT
// firn::check_scene: a scene is read, its snow is placed, a first frame is made in part, and what that took
// and showed is told.
#include "firn/check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "src/core/isa.h"
#include "src/core/threads.h"
#include "src/mpm/solver.h"
#include "src/render/frame_tracer.h"
#include "src/scene/scene.h"
#include "src/session/prepare.h"
#include "src/session/rehearsal.h"
#include "src/session/warnings.h"

namespace firn {
namespace {

constexpr double kStrained = 1.05;  // times as fast as unstrained, a wave in snow about to yield

Vector3 to_array(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

CheckedSnow checked(const PlacedSnow& snow) {
  const auto count = static_cast<double>(snow.position.size());
  Bounds bounds;
  for (const Vec3& p : snow.position) bounds.include(p);
  CheckedSnow out;
  out.name = snow.name;
  out.particles = snow.position.size();
  out.mass = count * snow.particle_mass();
  out.volume = count * snow.particle_volume;
  out.particle_mass = snow.particle_mass();
  out.bounds_min = to_array(bounds.min);
  out.bounds_max = to_array(bounds.max);
  return out;
}

void report_snow(CheckReport& report, const SolverSetup& setup) {
  for (const PlacedSnow& snow : setup.snow) {
    const CheckedSnow& one = report.snow.emplace_back(checked(snow));
    report.particles += one.particles;
    report.mass += one.mass;
  }
}

// A run does not keep the particles as they were placed, either.
SolverSetup without_particles(const SolverSetup& setup) {
  SolverSetup bare;
  bare.dx = setup.dx;
  bare.fixed_dt = setup.fixed_dt;
  bare.max_dt = setup.max_dt;
  for (const PlacedSnow& snow : setup.snow) bare.snow.emplace_back().material = snow.material;
  return bare;
}

// s; of the longest step while the snow is as it was placed, and of that which its packing may come to.
std::pair<double, double> elastic_steps(const SolverSetup& setup) {
  double fresh = setup.max_dt, packed = setup.max_dt;
  for (const PlacedSnow& snow : setup.snow) {
    const double dt = stable_dt(snow.material, setup.dx);
    fresh = std::min(fresh, dt);
    packed = std::min(packed, dt / (kStrained * wave_when_packed(snow.material)));
  }
  return {fresh, packed};
}

void report_time(CheckReport& report, const SceneConfig& scene, const SolverSetup& setup,
                 const TimeStep& step) {
  const auto [fresh, packed] = elastic_steps(setup);
  const double longest = setup.fixed_dt.value_or(std::max(step.dt, fresh));
  report.step = {setup.fixed_dt.value_or(step.dt), step.cause};
  report.fixed_dt = setup.fixed_dt.has_value();
  report.shortest_dt = setup.fixed_dt.value_or(std::min(step.dt, packed));
  report.frames = scene.time.frames;
  report.frame_seconds = scene.time.speed / scene.time.fps;
  const double least = std::ceil(report.frame_seconds / longest),
               most = std::ceil(report.frame_seconds / report.shortest_dt);
  const auto range = [](double low, double high) {
    return StepRange{static_cast<std::uint64_t>(low), static_cast<std::uint64_t>(high)};
  };
  const double moving = report.frames - 1;
  report.steps_per_frame = range(least, most);
  report.steps = range(least * moving, most * moving);
}

void report_memory(CheckReport& report, const Rehearsal& rehearsal, const Solver& simulation) {
  const auto bytes = [](double count) { return static_cast<std::uint64_t>(count); };
  const std::size_t particles = std::max<std::size_t>(simulation.particle_count(), 1);
  report.memory = {bytes(rehearsal.at_start), bytes(rehearsal.peak_low), bytes(rehearsal.peak_high),
                   simulation.resident_bytes(),
                   static_cast<double>(simulation.resident_bytes()) / static_cast<double>(particles)};
}

void report_image(CheckReport& report, const ImageSettings& image) {
  report.width = image.width;
  report.height = image.height;
  report.samples = image.samples;
  report.max_bounces = image.max_bounces;
}

void report_view(CheckReport& report, const RenderSetup& render, const Sights& sights) {
  const auto fraction = [&](std::size_t pixels) {
    return static_cast<double>(pixels) / static_cast<double>(sights.pixels);
  };
  for (std::size_t i = 0; i < sights.snow.size(); ++i)
    report.snow[i].pixel_fraction = fraction(sights.snow[i]);
  for (std::size_t i = 0; i < sights.objects.size(); ++i)
    report.objects.push_back({render.objects[i].name, fraction(sights.objects[i])});
  report.background_fraction = fraction(sights.nothing);
}

// What is found by making the first frame and steps.
void report_rehearsal(CheckReport& report, const SceneConfig& scene, Solver& simulation,
                      FrameTracer& renderer) {
  const Rehearsal rehearsal = rehearse(scene, simulation, renderer);
  report_memory(report, rehearsal, simulation);
  report_view(report, renderer.setup(), rehearsal.sights);
  for (SceneWarning& unseen : warnings_of_view(scene, rehearsal.sights))
    report.warnings.push_back(std::move(unseen));
}

CheckReport report_on(const SceneConfig& scene, const CheckOptions& options) {
  const auto& kernels = choose_kernels(options.isa);
  if (scene.output.movie && scene.time.frames > 1)
    require_movie(scene);  // in the order in which a run refuses
  const auto renderer = make_tracer(scene, kernels);
  SolverSetup setup = build_simulation(scene, options.force);
  CheckReport report;
  report.scene = scene.name;
  report.file = scene.file;
  report_snow(report, setup);
  report_image(report, scene.image);
  report.warnings = warnings_of_placement(scene, setup, renderer->setup());
  const SolverSetup bare = without_particles(setup);
  Solver simulation(kernels, std::move(setup));
  report.dx = bare.dx;
  report.grid_blocks = simulation.grid_blocks();
  report_time(report, scene, bare, simulation.stable_step());
  try {
    report_rehearsal(report, scene, simulation, *renderer);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::unstable) throw;
    report.blow_up = error;
  }
  return report;
}

}  // namespace

CheckReport check_scene(const Scene& scene, const CheckOptions& options) {
  const SceneConfig config = config_of(scene);
  return Threads(require_threads(options.threads)).run([&] { return report_on(config, options); });
}

}  // namespace firn
