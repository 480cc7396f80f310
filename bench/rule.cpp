// SPDX-License-Identifier: MIT
// firn-bench rule: is the right kernel asked? Camera rays, shadow rays to one light and bounce rays, in tiles
// of 8x8 pixels, each kind by packets, all together and one by one, against balls and against the
// smooth surface: and as the renderer has it. Packets have no greatest width here but where the rule decides.
#include "bench/rule.h"

#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "bench/trace_scene.h"
#include "bench/tracer.h"
#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/render/columns/ray_stream.h"
#include "src/render/snow/snow_field.h"

namespace firn::bench {

namespace {

constexpr int kTile = 8, kMostAcross = 256;  // pixels
constexpr std::size_t kRays = 1 << 16;
constexpr float kFar = std::numeric_limits<float>::infinity(), kAnyWidth = 1e9f;
constexpr double kFootprints[] = {1. / 16, 1. / 8, 1. / 4, 1. / 2, 1, 2, 4, 8};  // spacings a pixel
constexpr const char* kKinds[kRayKindCount] = {"primary", "shadow", "diffuse"};

struct Way {
  const char* name;
  bool packets;      // else all together
  std::size_t most;  // rays in a call
};
constexpr Way kWays[] = {{"packets", true, kRays}, {"together", false, kRays}, {"single", false, 1}};

// The snow of one kind, and how rays are traced against it.
struct Snow {
  const kernels::TraceKernels& kernels;
  const kernels::TraceGrid& grid;
  const kernels::SurfaceField* surface;  // null: balls

  void trace(RayStream& rays, RayKind kind, bool packets, const float* most_cells, std::size_t most) const {
    kernels::TraceGrid view = grid;
    if (most_cells != nullptr) view.cells_per_ray = *most_cells;
    const bool any = kind == RayKind::shadow;
    for (std::size_t i = 0; i < rays.size(); i += most) {
      const std::size_t end = std::min(i + most, rays.size());
      if (surface != nullptr) {
        const auto kernel = any ? (packets ? kernels.surface_occluded_coherent : kernels.surface_occluded)
                                : (packets ? kernels.surface_closest_coherent : kernels.surface_closest);
        kernel(view, *surface, rays.view(), i, end);
      } else {
        const auto kernel = any ? (packets ? kernels.occluded_coherent : kernels.occluded)
                                : (packets ? kernels.closest_coherent : kernels.closest);
        kernel(view, rays.view(), i, end);
      }
    }
  }
};

// Pictures of the middle, each moved by less than a pixel, until there are rays enough.
RayStream camera_rays(const TraceScene& scene, const Vec3& origin, double footprint, double width) {
  const Vec3 forward = (scene.center - scene.camera).normalized();
  const Vec3 right = forward.cross(Vec3::UnitY()).normalized(), down = forward.cross(right);
  const double pixel = footprint / (scene.center - scene.camera).norm();
  const int across = std::clamp(static_cast<int>(width / footprint) / kTile * kTile, kTile, kMostAcross);
  const Vec3f from = (scene.camera - origin).cast<float>();
  RayStream rays;
  for (std::uint64_t picture = 0; rays.size() < kRays; ++picture) {
    const double moved[2] = {uniform_double(hash_keys(11, picture, 0)),
                             uniform_double(hash_keys(11, picture, 1))};
    for (int k = 0; k < across * across && rays.size() < kRays; ++k) {
      const int tile = k / (kTile * kTile), tiles = across / kTile, in = k % (kTile * kTile);
      const double x = tile % tiles * kTile + in % kTile + moved[0] - 0.5 * across,
                   y = tile / tiles * kTile + in / kTile + moved[1] - 0.5 * across;
      rays.push(from, (forward + pixel * (x * right + y * down)).normalized().cast<float>(), kFar);
    }
  }
  return rays;
}

// From where camera rays end: to the light, or in all directions.
RayStream next_rays(const Snow& snow, const SnowField& field, RayStream camera, RayKind kind,
                    const Vec3f& light) {
  snow.trace(camera, RayKind::primary, true, nullptr, camera.size());
  RayStream rays;
  for (std::size_t i = 0; i < camera.size(); ++i) {
    const std::uint32_t hit = camera.hit(i);
    if (hit == kernels::kNoHit) continue;
    const Vec3f at = camera.at_hit(i);
    const Vec3f normal =
        hit == kernels::kSurfaceHit
            ? field.normal(at, -camera.direction(i))
            : Vec3f((at - Vec3f(snow.grid.x[hit], snow.grid.y[hit], snow.grid.z[hit])).normalized());
    const Vec3f start = at + 1e-3f * normal;
    if (kind == RayKind::shadow) {
      const Vec3f to_light = light - start;
      if (normal.dot(to_light) > 0) rays.push(start, to_light.normalized(), to_light.norm());
      continue;
    }
    const double z = 2 * uniform_double(hash_keys(12, i, 0)) - 1, r = std::sqrt(1 - z * z);
    const double angle = 2 * std::numbers::pi * uniform_double(hash_keys(12, i, 1));
    const Vec3f out = normal + Vec3(r * std::cos(angle), r * std::sin(angle), z).cast<float>();
    rays.push(start, out.norm() > 1e-3f ? Vec3f(out.normalized()) : normal, kFar);
  }
  return rays;
}

struct Measured {
  Best ways[std::size(kWays)], rule;
};

Measured measure(const Snow& snow, const RayStream& rays, RayKind kind, int repeats) {
  Measured m;
  for (int repeat = 0; repeat <= repeats; ++repeat) {  // the first makes lists, and counts for none
    const auto timed = [&](Best& best, bool packets, const float* most_cells, std::size_t most) {
      RayStream going = rays;
      const double seconds = seconds_of([&] { snow.trace(going, kind, packets, most_cells, most); });
      if (repeat > 0) best.add(seconds);
    };
    for (std::size_t w = 0; w < std::size(kWays); ++w)
      timed(m.ways[w], kWays[w].packets, &kAnyWidth, kWays[w].most);
    timed(m.rule, kind != RayKind::bounce, nullptr, rays.size());
  }
  return m;
}

}  // namespace

void run_rule(const RuleOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const TraceScene scene = trace_scene(options.shape, "blocks", options.particles);
  std::vector<SnowLook> looks(1);
  looks[0].radius = options.radius;
  RenderGrid balls(kernels.trace), grid(kernels.trace);
  balls.build(scene.snapshot, looks);
  grid.build(scene.snapshot, looks, true);
  SnowField field(kernels.trace);
  field.build(grid, scene.snapshot, looks);
  const Snow both[] = {{kernels.trace, balls.view(), nullptr},
                       {kernels.trace, field.view(), &field.surface()}};
  Json report = {{"isa", kernels.isa},
                 {"threads", 1},
                 {"shape", options.shape},
                 {"radius", options.radius},
                 {"particles", scene.snapshot.size()}};
  std::printf(
      "%s of %zu particles, 1 thread, %s, M rays/s; the best is marked, loss: of the rule against it\n",
      options.shape.c_str(), scene.snapshot.size(), kernels.isa);
  std::printf("%-8s %-8s %10s %9s %9s %9s %9s %6s\n", "snow", "rays", "footprint", "packets", "together",
              "single", "rule", "loss");
  const double width = std::cbrt(static_cast<double>(scene.snapshot.size()));
  for (const Snow& snow : both) {
    const Vec3 origin = snow.surface != nullptr ? grid.origin() : balls.origin();
    const char* name = snow.surface != nullptr ? "smooth" : "spheres";
    for (const RayKind kind : kRayKinds) {
      for (const double footprint : kFootprints) {
        RayStream rays = camera_rays(scene, origin, footprint, width);
        if (kind != RayKind::primary)
          rays = next_rays(snow, field, rays, kind, (scene.light - origin).cast<float>());
        if (rays.size() == 0) continue;
        const Measured m = measure(snow, rays, kind, options.repeats);
        const auto rate = [&](const Best& best) {
          return 1e-6 * static_cast<double>(rays.size()) / best.seconds();
        };
        double best = rate(m.rule);
        for (const Best& way : m.ways) best = std::max(best, rate(way));
        const char* kind_name = kKinds[static_cast<std::size_t>(kind)];
        Json row = {{"snow", name},
                    {"rays", kind_name},
                    {"footprint", footprint},
                    {"rule_mrays", rate(m.rule)},
                    {"loss", 1 - rate(m.rule) / best}};
        std::printf("%-8s %-8s %10.4g", name, kind_name, footprint);
        for (std::size_t w = 0; w < std::size(kWays); ++w) {
          row[std::string(kWays[w].name) + "_mrays"] = rate(m.ways[w]);
          std::printf(" %8.2f%s", rate(m.ways[w]), rate(m.ways[w]) == best ? "*" : " ");
        }
        std::printf(" %8.2f%s %5.1f%%\n", rate(m.rule), rate(m.rule) == best ? "*" : " ",
                    100 * (1 - rate(m.rule) / best));
        report["rule"].push_back(row);
      }
    }
  }
  add_provenance(report);
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
