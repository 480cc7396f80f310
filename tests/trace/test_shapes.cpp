// SPDX-License-Identifier: MIT
// Rays against objects: what they hit is the surface that geometry knows, and nothing lies before it.
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "src/core/rng.h"
#include "src/geometry/height_field.h"
#include "src/geometry/mesh.h"
#include "src/geometry/shape.h"
#include "src/render/solids/objects.h"
#include "tests/catch.h"
#include "tests/trace/ray_cases.h"

namespace firn::test::shapes {

namespace {

double uniform(std::uint64_t i, std::uint64_t which) { return 2 * uniform_double(hash_keys(i, which)) - 1; }
Vec3 in_cube(std::uint64_t i, std::uint64_t which) {
  return {uniform(i, which), uniform(i, which + 1), uniform(i, which + 2)};
}

Mat3 some_rotation() {
  Mat3 r;
  r << 2, -1, 2, 2, 2, -1, -1, 2, 2;
  return r / 3;
}

std::shared_ptr<const TriangleMesh> octahedron() {
  const std::vector<Vec3> vertices{{1, 0, 0}, {-1, 0, 0}, {0, 0.8, 0}, {0, -0.8, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<Triangle> triangles;
  for (const int x : {0, 1}) {
    for (const int y : {2, 3}) {
      for (const int z : {4, 5}) {
        const bool flip = ((x == 1) != (y == 3)) != (z == 5);
        triangles.push_back(flip ? Triangle{x, z, y} : Triangle{x, y, z});
      }
    }
  }
  return std::make_shared<TriangleMesh>(vertices, triangles);
}

std::vector<Shape> shapes() {
  std::vector<Shape> all(6);
  all[0].form = Ball{0.7};
  all[1].form = Box{Vec3(0.5, 0.3, 0.8)};
  all[2].form = Cylinder{0.5, 0.6};
  all[3].form = HalfSpace{};
  all[4].form = Mesh{octahedron()};
  all[5].form = Capsule{0.5, 0.4};
  for (Shape& shape : all) shape.pose = {some_rotation(), Vec3(0.2, -0.1, 0.15)};
  return all;
}

ObjectSet only(const Shape& shape, const Vec3& origin = Vec3::Zero()) {
  ObjectSet set(best_trace(), {Object{shape, 0}}, {Surface{}});
  set.place(origin);
  return set;
}

}  // namespace

TEST_CASE("rays end on the surface of a shape, and cross no surface before") {
  for (const Shape& shape : shapes()) {
    const ObjectSet set = only(shape);
    int hits = 0;
    for (std::uint64_t i = 0; i < 400; ++i) {
      Vec3 d = in_cube(i, 10).normalized();
      if (i % 4 == 0) d = Vec3::Unit(static_cast<Eigen::Index>(i / 4 % 3));
      const Vec3f o = (1.5 * in_cube(i, 0)).cast<float>(), direction = d.cast<float>();
      const ObjectHit hit = set.closest(o, direction, 6);
      const double reach = hit.object < 0 ? 6 : hit.t;
      CHECK(set.occluded(o, direction, 6) == (hit.object >= 0));
      const auto distance = [&](double t) {
        return signed_distance(shape, o.cast<double>() + t * direction.cast<double>());
      };
      if (hit.object >= 0) {
        ++hits;
        REQUIRE(std::fabs(distance(reach)) < 1e-5);
        const SurfaceDistance outside =
            closest_surface(shape, o.cast<double>() + reach * direction.cast<double>());
        if (hit.normal.cast<double>().dot(outside.normal) < 0.99) {  // an edge: both faces are right
          REQUIRE(std::fabs(distance(reach + 1e-3)) < 1e-3);
        }
      }
      const bool inside = distance(1e-6) < 0;
      for (int k = 1; k < 50; ++k) {
        const double there = distance(reach * k / 50.0);
        REQUIRE((std::fabs(there) < 1e-5 || (there < 0) == inside));
      }
    }
    CHECK(hits > 40);
  }
}

TEST_CASE("rays end on the triangles of a height field") {
  std::vector<double> heights(9 * 7);
  for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = 0.2 * uniform_double(hash_keys(3, i));
  Shape shape;
  shape.form = HeightField{std::make_shared<HeightRaster>(9, 7, heights, 2.0, 1.5), -0.5};
  const ObjectSet set = only(shape);
  for (std::uint64_t i = 0; i < 200; ++i) {
    const double x = 0.99 * uniform(i, 0), z = 0.74 * uniform(i, 1);
    const Vec3f o = Vec3(x, 3, z).cast<float>();
    const ObjectHit hit = set.closest(o, Vec3f(0, -1, 0), 10);
    REQUIRE(hit.object == 0);
    REQUIRE(hit.normal.y() > 0.3f);
    // A cell's two triangles and its bilinear patch share the border and differ inside by the twist.
    REQUIRE(std::fabs(3 - hit.t - std::get<HeightField>(shape.form).raster->sample(x, z).height) < 0.06);
    REQUIRE(set.closest(Vec3f(o.x(), -3, o.z()), Vec3f(0, 1, 0), 10).t == Approx(2.5));
  }
  CHECK(set.closest(Vec3f(-4, -0.2f, 0.1f), Vec3f(1, 0, 0), 10).t == Approx(3).epsilon(1e-6));
  CHECK(set.closest(Vec3f(0.3f, -0.2f, 5), Vec3f(0, 0, -1), 10).t == Approx(4.25).epsilon(1e-6));
  CHECK(set.closest(Vec3f(0, 3, 0.9f), Vec3f(0, -1, 0), 10).object == -1);
}

TEST_CASE("a shape far from the world's origin is hit as exactly as near it") {
  const Vec3 far(1e5, -2e5, 3e5);
  for (const Shape& shape : shapes()) {
    Shape moved = shape;
    moved.pose.translation += far;
    const ObjectSet near_set = only(shape), far_set = only(moved, far);
    for (std::uint64_t i = 0; i < 100; ++i) {
      const Vec3f o = (1.5 * in_cube(i, 0)).cast<float>(), d = in_cube(i, 10).normalized().cast<float>();
      const ObjectHit a = near_set.closest(o, d, 6), b = far_set.closest(o, d, 6);
      REQUIRE(a.object == b.object);
      REQUIRE(std::fabs(a.t - b.t) < 1e-6f);
    }
  }
}

TEST_CASE("a checker has squares of its size") {
  Surface surface;
  surface.albedo = Vec3f::Constant(0.8f);
  surface.checker = Vec3f::Constant(0.1f);
  surface.checker_size = 0.25;
  Shape plane;
  plane.form = HalfSpace{};
  ObjectSet set(best_trace(), {Object{plane, 0}}, {surface});
  set.place(Vec3::Zero());
  const auto shade = [&set](float x, float z) {
    return set.closest(Vec3f(x, 1, z), Vec3f(0, -1, 0), 5).albedo.x();
  };
  CHECK(shade(0.1f, 0.1f) == 0.8f);
  CHECK(shade(0.3f, 0.1f) == 0.1f);
  CHECK(shade(0.3f, 0.3f) == 0.8f);
  CHECK(shade(-0.1f, 0.1f) == 0.1f);
  CHECK(shade(-0.1f, -0.1f) == 0.8f);
  CHECK(shade(-0.3f, -0.1f) == 0.1f);
}

TEST_CASE("an object that moves is seen where it is at the frame's time") {
  Object ball{Shape{Ball{0.5}, {}}, 0, {}};
  ball.motion = Motion({{1, Vec3::Zero()}, {2, Vec3(2, 0, 0)}}, Vec3::Zero());
  ObjectSet set(best_trace(), {ball}, {Surface{}});
  const auto seen = [&](double time) {
    set.place(Vec3(0.25, 0, 0), time);
    return 5.25 - set.closest(Vec3f(5, 0, 0), Vec3f(-1, 0, 0), 20).t;  // world x of its far end
  };
  CHECK(seen(0) == Approx(0.5));
  CHECK(seen(1.5) == Approx(1.5));
  CHECK(seen(9) == Approx(2.5));
}

}  // namespace firn::test::shapes
