// SPDX-License-Identifier: MIT
#include "tests/light/pictures.h"

#include <tbb/global_control.h>

#include <bit>
#include <cmath>
#include <string>

#include "src/core/rng.h"
#include "tests/catch.h"
#include "tests/points.h"

namespace firn::test {

Snapshot snowball(const Vec3& center, double radius, double spacing, const Vec3& origin) {
  Points points(2 * spacing, origin);
  const int n = static_cast<int>(radius / spacing) + 1;
  std::uint64_t key = 0;
  for (int i = 0; i < (2 * n + 1) * (2 * n + 1) * (2 * n + 1); ++i) {
    Vec3 p(i % (2 * n + 1) - n, i / (2 * n + 1) % (2 * n + 1) - n, i / (2 * n + 1) / (2 * n + 1) - n);
    for (int a = 0; a < 3; ++a) p[a] += 0.5 * (uniform_double(hash_keys(9, key++)) - 0.5);
    p *= spacing;
    if (p.norm() > radius) continue;
    points.add(center + p - origin, spacing * spacing * spacing);
  }
  return points.snapshot();
}

RenderSetup empty_setup(const Vec3& position, const Vec3& target, double fov, int size, int samples,
                        int bounces) {
  RenderSetup setup;
  setup.camera.position = position;
  setup.camera.target = target;
  setup.camera.up = std::fabs((target - position).normalized().y()) > 0.9 ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
  setup.camera.fov = fov;
  setup.image = {size, size, samples, bounces};
  setup.snow.resize(1);
  return setup;
}

int add_surface(RenderSetup& setup, SurfaceKind kind, float grey) {
  Surface surface;
  surface.kind = kind;
  surface.albedo = Vec3f::Constant(grey);
  surface.emission = Vec3f::Constant(grey);
  setup.surfaces.push_back(surface);
  return static_cast<int>(setup.surfaces.size()) - 1;
}

void add_object(RenderSetup& setup, const Shape& shape, int surface) {
  setup.objects.push_back({shape, surface});
}

Shape floor_plane(double height) {
  Shape shape;
  shape.form = HalfSpace{};
  shape.pose.translation = Vec3(0, height, 0);
  return shape;
}

Picture render(const Snapshot& snapshot, const RenderSetup& setup, const kernels::KernelTable& kernels) {
  Picture film;
  RenderStats stats;
  FrameTracer(kernels, setup).render(snapshot, film, stats);
  return film;
}

Picture render(const Snapshot& snapshot, const RenderSetup& setup) {
  return render(snapshot, setup, *supported_kernels().back());
}

Vec3f mean(const Picture& film) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < film.rgb.size(); ++i) sum[static_cast<Eigen::Index>(i % 3)] += film.rgb[i];
  return (sum / (static_cast<double>(film.width) * film.height)).cast<float>();
}

std::uint64_t hash(const Picture& film) {
  std::uint64_t hash = 0;
  for (const float value : film.rgb) hash = hash_keys(hash, std::bit_cast<std::uint32_t>(value));
  return hash;
}

void require_same_bits(const Snapshot& snapshot, const RenderSetup& setup) {
  std::uint64_t expected = 0;
  for (const auto* table : supported_kernels()) {
    if (std::string(table->isa) == "base") continue;
    for (const std::size_t threads : {1, 2, 4}) {
      tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const std::uint64_t seen = hash(render(snapshot, setup, *table));
      if (expected == 0) expected = seen;
      INFO(table->isa << " with " << threads << " threads");
      CHECK(seen == expected);
    }
  }
}

}  // namespace firn::test
