// SPDX-License-Identifier: MIT
// firn-bench preview: what a frame of the preview costs, and what of it. The snow is that of `trace`, at the
// size of a snowball (0.15 m) or a dune of it, with facets, under a sun and a sky. Snow that moves is built
// anew for each frame; it goes down by a hundredth of a spacing. A frame ends with its picture in memory.
#include "bench/preview.h"

#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "bench/trace_scene.h"
#include "firn/error.h"
#include "src/core/isa.h"
#include "src/render/frame_tracer.h"

namespace firn::bench {

namespace {

constexpr int kWidth = 960, kHeight = 540;
constexpr double kSpacing = 0.15 / 62;  // m: a million fill a ball of 0.15 m

void shrink(Snapshot& snapshot) {
  const auto factor = static_cast<float>(kSpacing);
  snapshot.dx *= kSpacing;
  for (std::size_t a = 0; a < 3; ++a) {
    for (float& x : snapshot.position[a]) x *= factor;
  }
  for (float& volume : snapshot.volume0) volume *= factor * factor * factor;
}

// The camera goes round the middle, a degree a frame.
Camera camera_at(const TraceScene& scene, int frame) {
  const double angle = frame * 3.14159265358979 / 180;
  const Vec3 from = kSpacing * (scene.camera - scene.center);
  Camera camera;
  camera.target = kSpacing * scene.center;
  camera.fov = kViewAngle;
  camera.position = camera.target + Vec3(std::cos(angle) * from.x() + std::sin(angle) * from.z(), from.y(),
                                         std::cos(angle) * from.z() - std::sin(angle) * from.x());
  return camera;
}

RenderSetup setup_of(const TraceScene& scene) {
  RenderSetup setup;
  setup.camera = camera_at(scene, 0);
  setup.image.width = kWidth;
  setup.image.height = kHeight;
  setup.image.integrator = Integrator::preview;
  SnowLook look;
  look.density = 300;
  look.sparkle.density = 4e6;
  setup.snow = {look};
  setup.lights = {
      SunLight{scene.light - scene.center, 0.2666, Vec3f(2.9f, 2.45f, 1.9f)},
      SkyLight{Vec3f(0.12f, 0.24f, 0.52f), Vec3f(0.42f, 0.52f, 0.68f), Vec3f(0.25f, 0.27f, 0.3f)}};
  return setup;
}

// Each stage at its best; those of tiles are divided by the threads.
struct Stages {
  Best grid, field, primary, shadow, shade, still, moving;

  void add(const RenderStats& stats, int threads) {
    if (stats.build_seconds > 0) {
      grid.add(stats.build_seconds - stats.field_seconds);
      field.add(stats.field_seconds);
    }
    primary.add(stats.preview.primary / threads);
    shadow.add(stats.preview.shadow / threads);
    shade.add(stats.preview.shade / threads);
  }
  Json ms() const {
    return {{"grid", 1e3 * grid.seconds()},          {"field", 1e3 * field.seconds()},
            {"primary", 1e3 * primary.seconds()},    {"shadow", 1e3 * shadow.seconds()},
            {"shade", 1e3 * shade.seconds()},        {"frame_still", 1e3 * still.seconds()},
            {"frame_moving", 1e3 * moving.seconds()}};
  }
};

void print(const Json& r) {
  std::printf("%s: %zu particles, %d x %d, %d threads, %s, %s clock\n", r["shape"].get<std::string>().c_str(),
              r["particles"].get<std::size_t>(), kWidth, kHeight, r["threads"].get<int>(),
              r["isa"].get<std::string>().c_str(), r["clock"].get<std::string>().c_str());
  for (const auto& [name, ms] : r["ms"].items())
    std::printf("%-14s %7.1f ms\n", name.c_str(), ms.get<double>());
  std::printf("%.1f frames/s of snow that stands still, %.1f of snow that moves; %.1f M rays a frame\n",
              r["frames_per_second_still"].get<double>(), r["frames_per_second_moving"].get<double>(),
              1e-6 * r["rays"].get<double>());
}

}  // namespace

void run_preview(const PreviewOptions& options) {
  if (options.clock != "wall" && options.clock != "cpu")
    throw Error(ErrorCode::usage, "--clock", "'" + options.clock + "' is neither wall nor cpu");
  const auto timed = [&](auto&& work) {
    return options.clock == "cpu" ? cpu_seconds_of(work) / options.threads : seconds_of(work);
  };
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(options.threads));
  TraceScene scene = trace_scene(options.shape, "blocks", options.particles);
  shrink(scene.snapshot);
  FrameTracer renderer(kernels, setup_of(scene));
  Picture picture;
  RenderStats stats;
  Stages stages;
  for (int frame = 0; frame <= options.repeats; ++frame) {
    for (float& y : scene.snapshot.position[1]) y -= static_cast<float>(0.01 * kSpacing);
    const double moving = timed([&] { renderer.render(scene.snapshot, picture, stats); });
    if (frame == 0) continue;  // memory is fetched for the first time
    stages.add(stats, options.threads);
    stages.moving.add(moving);
    const Camera camera = camera_at(scene, frame);
    stages.still.add(timed([&] { renderer.look_again(scene.snapshot, camera, picture, stats); }));
    stages.add(stats, options.threads);
  }
  Json report = {{"ms", stages.ms()},
                 {"frames_per_second_still", 1 / stages.still.seconds()},
                 {"frames_per_second_moving", 1 / stages.moving.seconds()},
                 {"rays", stats.rays},
                 {"shape", options.shape},
                 {"particles", scene.snapshot.size()},
                 {"width", kWidth},
                 {"height", kHeight},
                 {"threads", options.threads},
                 {"isa", kernels.isa},
                 {"clock", options.clock}};
  add_provenance(report);
  print(report);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
