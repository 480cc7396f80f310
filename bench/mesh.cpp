// SPDX-License-Identifier: MIT
// firn-bench mesh: rays against a bumpy ball of triangles, one by one as the renderer asks: from a camera
// that it fills the picture of, in all directions from where these end, and from there to a light.
#include "bench/mesh.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include "bench/report.h"
#include "bench/stopwatch.h"
#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/render/solids/triangles.h"

namespace firn::bench {

namespace {

constexpr int kAcross = 512;  // pixels
constexpr double kFar = std::numeric_limits<double>::infinity();

struct MeshRays {
  std::vector<Vec3> origin, direction;
  std::size_t hits = 0;

  void push(const Vec3& o, const Vec3& d) { origin.push_back(o), direction.push_back(d); }
};

// By latitude and longitude, twice as many of these.
TriangleSet bumpy_ball(std::size_t triangles) {
  const int rows = static_cast<int>(std::lround(std::sqrt(static_cast<double>(triangles) / 4))),
            columns = 2 * rows;
  std::vector<Vec3> vertices;
  std::vector<Triangle> faces;
  for (int i = 0; i <= rows; ++i) {
    const double down = std::numbers::pi * i / rows;
    for (int k = 0; k < columns; ++k) {
      const double around = 2 * std::numbers::pi * k / columns;
      const Vec3 n(std::sin(down) * std::cos(around), std::cos(down), std::sin(down) * std::sin(around));
      vertices.push_back(n * (1 + 0.05 * std::sin(11 * n.x()) * std::sin(13 * n.y()) * std::cos(12 * n.z())));
    }
  }
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < columns; ++k) {
      const int a = i * columns + k, b = i * columns + (k + 1) % columns;
      if (i > 0) faces.push_back({a, b, a + columns});
      if (i + 1 < rows) faces.push_back({b, b + columns, a + columns});
    }
  }
  return {std::move(vertices), std::move(faces)};
}

MeshRays camera_rays() {
  MeshRays rays;
  for (int y = 0; y < kAcross; ++y) {
    for (int x = 0; x < kAcross; ++x)
      rays.push(Vec3(0, 0, 4),
                Vec3(0.56 * (x + 0.5) / kAcross - 0.28, 0.28 - 0.56 * (y + 0.5) / kAcross, -1).normalized());
  }
  return rays;
}

Vec3 on_sphere(std::size_t ray) {
  const double z = 2 * uniform_double(hash_keys(3, ray, 0)) - 1, r = std::sqrt(1 - z * z);
  const double angle = 2 * std::numbers::pi * uniform_double(hash_keys(3, ray, 1));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace

void run_mesh(const MeshOptions& options) {
  const kernels::KernelTable& kernels = choose_kernels(options.isa);
  const TriangleSet mesh = bumpy_ball(options.triangles);
  Best build, camera, bounce, shadow;
  MeshRays from_camera = camera_rays(), from_hits, to_light;
  const auto closest = [&](const MeshRays& rays, std::size_t i, std::int32_t& met) {
    return kernels.trace.mesh_closest(mesh.view(), rays.origin[i].data(), rays.direction[i].data(), kFar,
                                      met);
  };
  for (std::size_t i = 0; i < from_camera.origin.size(); ++i) {
    std::int32_t met = -1;
    const double t = closest(from_camera, i, met);
    if (met < 0) continue;
    const Vec3 normal = mesh.normal(met) * (mesh.normal(met).dot(from_camera.direction[i]) < 0 ? 1 : -1);
    const Vec3 at = from_camera.origin[i] + t * from_camera.direction[i] + 1e-6 * normal;
    from_hits.push(at, (normal + on_sphere(i)).normalized());
    to_light.push(at, (Vec3(3, 5, 2) - at).normalized());
  }
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    build.add(seconds_of([&] { build_triangle_tree(mesh.vertices(), mesh.triangles()); }));
    for (const auto& [kind, best] : {std::pair{&from_camera, &camera}, std::pair{&from_hits, &bounce}}) {
      auto* const rays = kind;  // clang 14 captures no structured binding
      rays->hits = 0;
      best->add(seconds_of([&] {
        for (std::size_t i = 0; i < rays->origin.size(); ++i) {
          std::int32_t met = -1;
          closest(*rays, i, met);
          rays->hits += met >= 0;
        }
      }));
    }
    to_light.hits = 0;
    shadow.add(seconds_of([&] {
      for (std::size_t i = 0; i < to_light.origin.size(); ++i)
        to_light.hits += kernels.trace.mesh_occluded(mesh.view(), to_light.origin[i].data(),
                                                     to_light.direction[i].data(), 5);
    }));
  }
  const auto rate = [](const MeshRays& rays, const Best& best) {
    return 1e-6 * static_cast<double>(rays.origin.size()) / best.seconds();
  };
  Json report = {{"triangles", mesh.triangles().size()},
                 {"isa", kernels.isa},
                 {"threads", 1},
                 {"build_ms", 1e3 * build.seconds()},
                 {"primary_mrays", rate(from_camera, camera)},
                 {"shadow_mrays", rate(to_light, shadow)},
                 {"diffuse_mrays", rate(from_hits, bounce)},
                 {"hits", {from_camera.hits, to_light.hits, from_hits.hits}}};
  add_provenance(report);
  std::printf(
      "%zu triangles, 1 thread, %s: build %.1f ms; M rays/s: primary %.2f, shadow %.2f, diffuse %.2f\n",
      mesh.triangles().size(), kernels.isa, 1e3 * build.seconds(), rate(from_camera, camera),
      rate(to_light, shadow), rate(from_hits, bounce));
  std::printf("hits: primary %zu of %zu, shadow %zu of %zu, diffuse %zu of %zu\n", from_camera.hits,
              from_camera.origin.size(), to_light.hits, to_light.origin.size(), from_hits.hits,
              from_hits.origin.size());
  if (!options.json.empty()) write_json(report, options.json);
}

}  // namespace firn::bench
