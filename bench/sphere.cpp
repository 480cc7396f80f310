// SPDX-License-Identifier: MIT
// firn-bench sphere: a sphere of the homogeneous medium that pbrt-v3 takes where a file names none (2.55 3.21
// 3.77 scatterings and 0.0011 0.0024 0.014 absorptions a unit of length, even phase function), of radius 1,
// lit by a ball and seen whole by 128 x 128 pixels. A path is one camera sample with its light subpath;
// subpaths scatter up to 50 times from the camera and 15 times from the light.
#include "bench/sphere.h"

#include <tbb/global_control.h>

#include <cstdio>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "firn/error.h"
#include "src/core/isa.h"
#include "src/render/frame_tracer.h"

namespace firn::bench {
namespace {

constexpr int kSize = 128;

Integrator integrator_of(const std::string& name) {
  if (name == "bidirectional") return Integrator::bidirectional;
  if (name == "path") return Integrator::path;
  throw Error(ErrorCode::usage, "--integrator", "'" + name + "' is neither bidirectional nor path");
}

RenderSetup setup_of(const SphereOptions& options) {
  RenderSetup setup;
  setup.camera.position = Vec3(0, 0, 5);
  setup.camera.fov = 30;
  setup.image.width = setup.image.height = kSize;
  setup.image.samples = options.samples;
  setup.image.integrator = integrator_of(options.integrator);
  setup.image.max_bounces = 50;
  setup.image.light_bounces = 15;
  setup.image.filter = FilterKind::box;
  Medium medium;
  medium.shape.form = Ball{1};
  medium.sigma_s = Vec3f(2.55f, 3.21f, 3.77f);
  medium.sigma_a = Vec3f(0.0011f, 0.0024f, 0.014f);
  setup.media = {medium};
  setup.lights = {SphereLight{Vec3(2, 3, 2), 0.5, Vec3f::Constant(30)}};
  return setup;
}

}  // namespace

void run_sphere(const SphereOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(options.threads));
  FrameTracer renderer(kernels, setup_of(options));
  Picture picture;
  RenderStats stats;
  Best best;
  for (int k = 0; k < options.repeats; ++k)
    best.add(seconds_of([&] { renderer.render({}, picture, stats); }));
  const double paths = static_cast<double>(kSize) * kSize * options.samples;
  double mean = 0;
  for (const float value : picture.rgb) mean += value / static_cast<double>(picture.rgb.size());
  Json report = {{"integrator", options.integrator},
                 {"paths_per_second", paths / best.seconds()},
                 {"rays_a_path", static_cast<double>(stats.rays) / paths},
                 {"mean", mean},
                 {"samples", options.samples},
                 {"threads", options.threads},
                 {"isa", kernels.isa}};
  add_provenance(report);
  std::printf(
      "sphere, %d x %d, %d samples, %s, %d threads, %s: %.3f M paths/s, %.2f rays a path, mean %.5f\n", kSize,
      kSize, options.samples, options.integrator.c_str(), options.threads, kernels.isa,
      1e-6 * paths / best.seconds(), static_cast<double>(stats.rays) / paths, mean);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
