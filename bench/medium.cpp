// SPDX-License-Identifier: MIT
// firn-bench medium: what a flight through snow costs, from random places in a ball in random directions.
// Each batch of rays is timed by itself, several times, and its best time counts.
#include "bench/medium.h"

#include <tbb/global_control.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "bench/trace_scene.h"
#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/render/columns/ray_stream.h"
#include "src/render/snow/snow_field.h"

namespace firn::bench {

namespace {

constexpr std::size_t kRays = 1 << 17, kBatch = 4096;
constexpr int kPasses = 20;
constexpr double kDensity = 300;  // kg/m^3

double uniform(std::uint64_t ray, std::uint64_t which) { return uniform_double(hash_keys(9, ray, which)); }

Vec3 direction(std::uint64_t ray, std::uint64_t which) {
  const double z = 2 * uniform(ray, which) - 1, r = std::sqrt(1 - z * z);
  const double angle = 2 * std::numbers::pi * uniform(ray, which + 1);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

// All start within the ball.
std::vector<RayStream> batches(const Vec3& center, double radius) {
  std::vector<RayStream> rays(kRays / kBatch);
  for (std::uint64_t i = 0; i < kRays; ++i) {
    const Vec3 from = center + radius * std::cbrt(uniform(i, 0)) * direction(i, 1);
    rays[i / kBatch].push(from.cast<float>(), direction(i, 3).cast<float>(),
                          std::numeric_limits<float>::infinity());
  }
  return rays;
}

// ns a flight.
double time_flights(const kernels::TraceKernels& kernels, const SnowField& field,
                    const kernels::MediumField& medium, const std::vector<RayStream>& rays) {
  std::vector<std::uint64_t> keys(kBatch);
  for (std::size_t i = 0; i < kBatch; ++i) keys[i] = mix64(i);
  std::vector<Best> best(rays.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::size_t k = 0; k < rays.size(); ++k) {
      RayStream flying = rays[k];
      best[k].add(seconds_of([&] {
        kernels.collide(field.view(), medium, flying.view(), keys.data(), nullptr, 0, flying.size());
      }));
    }
  }
  double sum = 0;
  for (const Best& each : best) sum += each.seconds();
  return 1e9 * sum / kRays;
}

}  // namespace

void run_medium(const MediumOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const TraceScene scene = trace_scene("ball", "blocks", options.particles);
  Json report = {{"isa", kernels.isa}, {"threads", 1}, {"particles", scene.snapshot.size()}};
  std::printf("flights through a ball of %zu particles, 1 thread, %s\n", scene.snapshot.size(), kernels.isa);
  for (const SnowShape shape : {SnowShape::smooth, SnowShape::spheres}) {
    RenderGrid grid(kernels.trace);
    SnowField field(kernels.trace);
    for (const double optical : {0.5, 4.}) {
      SnowLook look;
      look.density = kDensity;
      look.extinction = 1;
      grid.build(scene.snapshot, {look}, true);
      look.extinction = optical / (kDensity * grid.view().cell);
      const double build = seconds_of([&] { field.build(grid, scene.snapshot, {look}, shape); });
      kernels::MediumField medium;
      const double prepare = seconds_of([&] { medium = field.medium({.similarity = Similarity::never}); });
      const double deep = seconds_of([&] { field.medium({}); });
      medium = field.medium({.similarity = Similarity::never});
      const double radius =
          std::cbrt(3 * static_cast<double>(scene.snapshot.size()) / (4 * std::numbers::pi));
      const double ns =
          time_flights(kernels.trace, field, medium, batches(scene.center - grid.origin(), 0.98 * radius));
      const char* name = shape == SnowShape::smooth ? "smooth" : "spheres";
      std::printf(
          "%-8s %.1f mean free paths a cell: %6.1f ns a flight; fields %.1f ms, majorants %.1f ms, "
          "with deep cells %.1f ms\n",
          name, optical, ns, 1e3 * build, 1e3 * prepare, 1e3 * deep);
      report["flights"].push_back({{"snow", name},
                                   {"mean_free_paths_a_cell", optical},
                                   {"ns", ns},
                                   {"fields_ms", 1e3 * build},
                                   {"majorants_ms", 1e3 * prepare},
                                   {"deep_ms", 1e3 * deep}});
    }
  }
  add_provenance(report);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
