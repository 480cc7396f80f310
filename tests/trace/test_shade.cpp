// SPDX-License-Identifier: MIT
// What shading asks of many points at once, against the same asked of one: of every particle in double, of
// the scalar code of src/render, and packets of rays against the stream.
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "src/core/rng.h"
#include "src/core/rotation.h"
#include "src/render/camera.h"
#include "src/render/columns/vector_columns.h"
#include "src/render/snow/facets.h"
#include "src/render/snow/grain.h"
#include "src/render/snow/snow_field.h"
#include "tests/catch.h"
#include "tests/trace/ray_cases.h"

namespace firn::test::shade {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

struct Scene {
  Scene(Snapshot given, const kernels::KernelTable& table)
      : snapshot(std::move(given)), grid(table.trace), field(table.trace) {
    grid.build(snapshot, {SnowLook{}}, true);
    field.build(grid, snapshot, {SnowLook{}});
  }
  Snapshot snapshot;
  RenderGrid grid;
  SnowField field;
};

float uniform(std::uint64_t a, std::uint64_t b) { return uniform_float(hash_keys(a, b)); }
Vec3f uniform_vector(std::uint64_t key, std::uint64_t i) {
  return Vec3f(uniform(key, 3 * i), uniform(key, 3 * i + 1), uniform(key, 3 * i + 2)) - Vec3f::Constant(0.5f);
}

// Camera rays onto the scene, 8 x 8 pixels after 8 x 8 pixels, as the preview has them.
RayStream camera_rays(const Scene& scene, const Vec3& world_eye, int side, double wide) {
  const Vec3 eye = world_eye - scene.grid.origin(), forward = -world_eye.normalized();
  const Vec3 right = forward.cross(Vec3(0.1, 1, 0.2)).normalized(), down = forward.cross(right);
  RayStream rays;
  for (int block = 0; block < side * side / 64; ++block) {
    for (int k = 0; k < 64; ++k) {
      const int x = block % (side / 8) * 8 + k % 8, y = block / (side / 8) * 8 + k / 8;
      const Vec3 d =
          forward + wide * ((2 * (x + 0.5) / side - 1) * right + (2 * (y + 0.5) / side - 1) * down);
      rays.push(eye.cast<float>(), d.normalized().cast<float>(), kInf);
    }
  }
  return rays;
}

// Points of the surface under such rays, neighbours beside neighbours, and some that lie anywhere.
std::vector<Vec3f> surface_points(const Scene& scene, const kernels::KernelTable& table) {
  RayStream rays = camera_rays(scene, Vec3(20, 25, -30), 64, 0.4);
  table.trace.surface_closest(scene.field.view(), scene.field.surface(), rays.view(), 0, rays.size());
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays.hit(i) == kernels::kSurfaceHit) points.push_back(rays.at_hit(i));
    if (i % 97 == 0) points.push_back(uniform_vector(5, i) * 60 - scene.grid.origin().cast<float>());
  }
  return points;
}

VectorColumns columns_of(const std::vector<Vec3f>& vectors) {
  VectorColumns columns;
  columns.resize(vectors.size());
  for (std::size_t i = 0; i < vectors.size(); ++i) columns.set(i, vectors[i]);
  return columns;
}

// Whether two streams met the same, to `margin` m and but for `odd` rays.
void check_same(const RayStream& a, const RayStream& b, float margin, std::size_t odd) {
  std::size_t different = 0, hits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    hits += a.hit(i) != kernels::kNoHit;
    const bool apart = a.hit(i) != kernels::kNoHit && std::fabs(a.t(i) - b.t(i)) > margin;
    different += a.hit(i) != b.hit(i) || apart;
  }
  INFO(different << " of " << hits << " hits");
  CHECK(different <= odd);
  CHECK(hits > a.size() / 20);
}

}  // namespace

TEST_CASE("packets of rays meet the smooth surface and its loose balls where the stream does") {
  Snapshot snapshot = lattice_ball(9);
  for (int k = 0; k < 60; ++k) add_particle(snapshot, (13 * uniform_vector(8, k)).cast<double>() * 2, 1);
  for (const auto* table : supported_kernels()) {
    const Scene scene(snapshot, *table);
    const kernels::TraceGrid& grid = scene.field.view();
    for (const double wide : {0.02, 0.3, 3.}) {  // narrow, as pictures are, and wider than packets like
      INFO(table->isa << ", width " << wide);
      RayStream stream = camera_rays(scene, Vec3(20, 25, -30), 64, wide), packets = stream;
      table->trace.surface_closest(grid, scene.field.surface(), stream.view(), 0, stream.size());
      table->trace.surface_closest_coherent(grid, scene.field.surface(), packets.view(), 0, packets.size());
      if (wide < 1) check_same(stream, packets, 1e-4f, 2);
      // Shadow rays from there, some of which begin in the snow, in numbers that fill no packet.
      RayStream shadows;
      const Vec3f sun = Vec3f(-0.3f, 0.8f, 0.4f).normalized();
      for (std::size_t i = 0; i < stream.size(); ++i) {
        if (stream.hit(i) != kernels::kNoHit)
          shadows.push(stream.at_hit(i) + (2 * uniform(4, i) - 0.5f) * sun, sun, kInf);
      }
      RayStream one_by_one = shadows;
      table->trace.surface_occluded(grid, scene.field.surface(), one_by_one.view(), 0, one_by_one.size());
      table->trace.surface_occluded_coherent(grid, scene.field.surface(), shadows.view(), 0, shadows.size());
      if (wide < 1) check_same(one_by_one, shadows, 0, 2);
    }
    RayStream within = make_rays(scene.grid, RayKind::inside, 640, 3), packets = within;  // from in the snow
    table->trace.surface_closest(grid, scene.field.surface(), within.view(), 0, within.size());
    table->trace.surface_closest_coherent(grid, scene.field.surface(), packets.view(), 0, packets.size());
    for (std::size_t i = 0; i < within.size(); ++i) {
      REQUIRE(packets.hit(i) == within.hit(i));
      if (within.hit(i) != kernels::kNoHit) REQUIRE(packets.t(i) == Approx(within.t(i)).margin(1e-4));
    }
  }
}

TEST_CASE("the nearest particle of a point is that of all particles, if it is near enough") {
  for (const auto* table : supported_kernels()) {
    const Scene scene(cloud(4000, 6, 2), *table);
    const std::vector<Vec3f> points = surface_points(scene, *table);
    const VectorColumns columns = columns_of(points);
    std::vector<std::uint32_t> nearest(points.size());
    table->shade.nearest(scene.grid.view(), columns.view(), 0, points.size(), nearest.data());
    std::size_t found = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      double least = INFINITY;
      for (std::uint32_t s = 0; s < scene.grid.size(); ++s)
        least = std::min(least, (scene.grid.center(s) - points[i]).cast<double>().norm());
      INFO(table->isa << ", point " << i);
      if (nearest[i] == kernels::kNoHit) {
        REQUIRE(least > 0.9999 * scene.grid.view().cell);
      } else {
        ++found;
        REQUIRE((scene.grid.center(nearest[i]) - points[i]).cast<double>().norm() < least + 1e-5);
        REQUIRE(least < 1.0001 * scene.grid.view().cell);
      }
    }
    CHECK(found > points.size() / 2);
  }
}

TEST_CASE("normals of many points, with and without grain, are those of one") {
  for (const auto* table : supported_kernels()) {
    const Scene scene(cloud(4000, 6, 2), *table);
    const std::vector<Vec3f> points = surface_points(scene, *table);
    const std::size_t count = points.size();
    std::vector<Vec3f> local(count), back(count);
    std::vector<std::uint32_t> id(count);
    for (std::size_t i = 0; i < count; ++i) {
      local[i] = 3 * uniform_vector(11, i);
      back[i] = uniform_vector(12, i).normalized();
      id[i] = static_cast<std::uint32_t>(mix64(i));
    }
    const VectorColumns places = columns_of(points), locals = columns_of(local), backs = columns_of(back);
    VectorColumns smooth, grained_normal;
    smooth.resize(count), grained_normal.resize(count);
    smooth.fill([&](float* const normal[3]) {
      table->shade.normals(scene.grid.view(), scene.field.gradients(), places.view(), 0, count, normal);
    });
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f expected = scene.field.normal(points[i], Vec3f::Zero());
      INFO(table->isa << ", point " << i);
      REQUIRE((smooth[i] - expected).norm() < 2e-4f);
      if (smooth[i].norm() < 0.5f) smooth.set(i, back[i]);
    }
    const kernels::GrainView view{smooth.view(), locals.view(), backs.view(), id.data()};
    grained_normal.fill([&](float* const normal[3]) { table->shade.grain(view, 0, count, normal); });
    for (std::size_t i = 0; i < count; ++i) {
      INFO(table->isa << ", point " << i);
      REQUIRE((grained_normal[i] - grained(smooth[i], local[i], id[i], back[i])).norm() < 1e-5f);
    }
  }
}

TEST_CASE("points that may glint are all that have a facet, and few others") {
  SparkleSettings settings;
  settings.density = 4e6;
  const FacetField facets(settings);
  constexpr std::size_t kPoints = 6001;
  constexpr float kChord = 0.0524f, kLight = 0.0023f;
  const kernels::FacetCells cells = facets.cells(kChord, facets.cell());
  std::vector<Vec3f> local, smooth, back, light;
  std::vector<std::uint32_t> id;
  std::vector<std::int16_t> turn[3];
  std::vector<float> chord(kPoints, kLight), footprint;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const std::size_t particle = i / 13;  // neighbours share one
    id.push_back(static_cast<std::uint32_t>(particle));
    for (int a = 0; a < 3; ++a)
      turn[a].push_back(static_cast<std::int16_t>(20000 * (uniform(30 + a, particle) - 0.5f)));
    smooth.push_back((uniform_vector(21, particle) + 0.1f * uniform_vector(22, i)).normalized());
    back.push_back((smooth[i] + uniform_vector(23, particle) + 0.02f * uniform_vector(23, i)).normalized());
    light.push_back((smooth[i] + 2 * uniform_vector(24, particle)).normalized());
    local.push_back(3e-3f * uniform_vector(25, i));
    footprint.push_back(i < kPoints / 2 ? 3e-4f : 2e-3f * uniform(26, i));
  }
  const VectorColumns at = columns_of(local), n = columns_of(smooth), o = columns_of(back),
                      l = columns_of(light);
  const kernels::GlintView view{id.data(),    {turn[0].data(), turn[1].data(), turn[2].data()},
                                at.view(),    n.view(),
                                o.view(),     l.view(),
                                chord.data(), footprint.data()};
  for (const auto* table : supported_kernels()) {
    std::vector<std::uint8_t> glints(kPoints);
    table->shade.may_glint(cells, view, 0, kPoints, glints.data());
    std::size_t shining = 0, said = 0;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const Eigen::Matrix3f turned = unpack_rotation({turn[0][i], turn[1][i], turn[2][i]}).transpose();
      const Vec3f p = turned * local[i], normal = turned * smooth[i],
                  half = turned * (back[i] + light[i]).normalized();
      const float deep = facets.radius(), wide = std::max(std::min(footprint[i], facets.cell()), deep);
      bool shines = false;
      facets.near(id[i], p, Vec3f::Constant(wide), half, kChord + kLight,
                  [&](const Vec3f& place, const Vec3f& facet) {
                    const Vec3f off = place - p;
                    const float depth = off.dot(normal), aside2 = off.squaredNorm() - depth * depth;
                    shines = shines || ((facet - half).norm() < kChord + kLight &&
                                        aside2 * (deep / wide) * (deep / wide) + depth * depth < deep * deep);
                  });
      shines = shines && smooth[i].dot(back[i]) > 0 && smooth[i].dot(light[i]) > 0;
      shining += shines, said += glints[i] != 0;
      INFO(table->isa << ", point " << i);
      if (shines) REQUIRE(glints[i] == 1);
    }
    INFO(table->isa << ": " << said << " may, " << shining << " do");
    CHECK(shining > 50);
    CHECK(said < kPoints / 3);
  }
}

TEST_CASE("many pixels look where one does") {
  Camera camera;
  camera.position = Vec3(3, 2, 5);
  camera.fov = 40;
  ImageSettings image;
  image.width = 67, image.height = 41;
  const CameraRays rays(camera, image);
  const std::size_t count = 67 * 41;
  std::vector<std::int32_t> x(count), y(count);
  for (int k = 0; k < image.width * image.height; ++k) x[k] = k % image.width, y[k] = k / image.width;
  for (const auto* table : supported_kernels()) {
    VectorColumns directions;
    directions.resize(count);
    std::vector<float> spread(x.size());
    directions.fill([&](float* const direction[3]) {
      table->shade.sights(rays.pinhole(), x.data(), y.data(), 0, x.size(), direction, spread.data());
    });
    for (std::size_t k = 0; k < x.size(); ++k) {
      const Vec3f expected = rays.middle_ray(x[k], y[k]).direction;
      REQUIRE((directions[k] - expected).norm() < 2e-7f);
      REQUIRE(spread[k] == Approx(0.5f / std::sqrt(rays.film_density(expected))).epsilon(1e-5));
    }
  }
}

}  // namespace firn::test::shade
