// SPDX-License-Identifier: MIT
// Signed distances, normals, bounds and volumes of the analytic shapes, against known values and against
// brute force.
#include <Eigen/Geometry>
#include <cmath>

#include "src/core/rng.h"
#include "src/geometry/shape.h"
#include "tests/catch.h"

namespace firn::test::geometry {
namespace {

Pose tilted() {
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();
  pose.translation = Vec3(0.3, -1.2, 2.0);
  return pose;
}

Vec3 random_point(std::uint64_t key, double half) {
  const auto axis = [&](int k) { return half * (2 * uniform_double(hash_keys(key, k)) - 1); };
  return {axis(0), axis(1), axis(2)};
}

std::vector<Shape> bounded_shapes() {
  return {{Ball{0.4}, tilted()},
          {Box{Vec3(0.5, 0.2, 0.3)}, tilted()},
          {Cylinder{0.3, 0.45}, tilted()},
          {Capsule{0.3, 0.25}, tilted()}};
}

}  // namespace

TEST_CASE("signed distances of simple shapes have the values that geometry gives") {
  CHECK(signed_distance({Ball{2}, {}}, Vec3(3, 0, 0)) == Approx(1));
  CHECK(signed_distance({Ball{2}, {}}, Vec3(0, 0, 0)) == Approx(-2));
  CHECK(signed_distance({Box{Vec3(1, 2, 3)}, {}}, Vec3(0, 0, 0)) == Approx(-1));
  CHECK(signed_distance({Box{Vec3(1, 2, 3)}, {}}, Vec3(4, 6, 3)) == Approx(5));
  CHECK(signed_distance({Cylinder{1, 2}, {}}, Vec3(4, 6, 0)) == Approx(5));
  CHECK(signed_distance({Cylinder{1, 2}, {}}, Vec3(0.5, 1.9, 0)) == Approx(-0.1));
  CHECK(signed_distance({Capsule{1, 2}, {}}, Vec3(3, 6, 0)) == Approx(4));
  CHECK(signed_distance({Capsule{1, 2}, {}}, Vec3(0.4, 1.5, 0)) == Approx(-0.6));
  CHECK(signed_distance({HalfSpace{}, {}}, Vec3(7, -3, 1)) == Approx(-3));
}

TEST_CASE("the normal is the gradient of the signed distance") {
  const double h = 1e-6;
  for (const Shape& shape : bounded_shapes()) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = shape.pose.to_world(random_point(i, 1.0));
      const SurfaceDistance point = closest_surface(shape, p);
      Vec3 gradient;
      for (int k = 0; k < 3; ++k) {
        gradient[k] =
            (signed_distance(shape, p + h * Vec3::Unit(k)) - signed_distance(shape, p - h * Vec3::Unit(k))) /
            (2 * h);
      }
      CHECK((gradient - point.normal).norm() < 1e-4);
      CHECK(point.normal.norm() == Approx(1).epsilon(1e-12));
    }
  }
}

TEST_CASE("walking the signed distance along the normal ends on the surface") {
  for (const Shape& shape : bounded_shapes()) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = shape.pose.to_world(random_point(1000 + i, 1.0));
      const SurfaceDistance point = closest_surface(shape, p);
      CHECK(std::abs(signed_distance(shape, p - point.distance * point.normal)) < 1e-12);
    }
  }
}

TEST_CASE("the volume inside a shape is the fraction of random points with a negative distance") {
  for (const Shape& shape : bounded_shapes()) {
    const Bounds bounds = world_bounds(shape);
    const int count = 40000;
    int inside = 0;
    for (int i = 0; i < count; ++i) {
      const Vec3 p = bounds.center() + random_point(i, 0.5).cwiseProduct(bounds.size());
      inside += signed_distance(shape, p) < 0;
    }
    const double fraction = *volume(shape) / bounds.size().prod();
    const double deviation = std::sqrt(fraction * (1 - fraction) / count);
    CHECK(std::abs(static_cast<double>(inside) / count - fraction) < 4 * deviation);
  }
}

TEST_CASE("world bounds hold every point of the shape") {
  for (const Shape& shape : bounded_shapes()) {
    const Bounds bounds = world_bounds(shape);
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p = shape.pose.to_world(random_point(i, 0.8));
      if (signed_distance(shape, p) > 0) continue;
      CHECK_FALSE((p.array() < bounds.min.array() - 1e-12).any());
      CHECK_FALSE((p.array() > bounds.max.array() + 1e-12).any());
    }
  }
}

TEST_CASE("a half space is unbounded and has no volume") {
  CHECK_FALSE(volume({HalfSpace{}, tilted()}).has_value());
  CHECK(world_bounds({HalfSpace{}, tilted()}).max.x() == 1e300);
}

}  // namespace firn::test::geometry
