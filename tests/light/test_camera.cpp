// SPDX-License-Identifier: MIT
// The camera: its rays, and the same rays from the other end.
#include <Eigen/Geometry>
#include <cmath>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/render/camera.h"
#include "tests/catch.h"

namespace firn::test::camera {
namespace {

Camera tilted(double aperture) {
  Camera camera;
  camera.position = Vec3(1, 2, 3);
  camera.target = Vec3(0.2, -0.1, -1);
  camera.fov = 40;
  camera.aperture = aperture;
  return camera;
}

ImageSettings wide() {
  ImageSettings image;
  image.width = 60;
  image.height = 40;
  return image;
}

Sample2 random_pair(std::uint64_t a, std::uint64_t b) {
  return {uniform_float(hash_keys(a, b, 0)), uniform_float(hash_keys(a, b, 1))};
}

}  // namespace

TEST_CASE("the target is in the middle of the picture, up is up, and the angle of view is fov") {
  ImageSettings image = wide();
  image.filter = FilterKind::box;
  image.filter_width = 1e-6;
  CameraRays camera(tilted(0), image);
  const Vec3 view = (tilted(0).target - tilted(0).position).normalized();
  CameraSight sight;
  REQUIRE(camera.see(Vec3f(0.2f, -0.1f, -1), {0, 0}, sight));
  CHECK(sight.x == Approx(30).margin(1e-3));
  CHECK(sight.y == Approx(20).margin(1e-3));
  CHECK(sight.cosine == Approx(1));
  REQUIRE(camera.see(Vec3f(0.2f, 0, -1), {0, 0}, sight));
  CHECK(sight.y < 20);
  CHECK(sight.x == Approx(30).margin(1e-3));
  // Half a pixel within the upper and lower edges.
  const Vec3f top = camera.ray(29, 0, {0.5f, 0.5f}, {0, 0}).direction;
  const Vec3f bottom = camera.ray(29, 39, {0.5f, 0.5f}, {0, 0}).direction;
  const double half = std::atan(std::tan(20 * M_PI / 180) * 39 / 40);
  const double sideways = std::atan(std::tan(20 * M_PI / 180) / 40);
  CHECK(std::acos(static_cast<double>(top.dot(bottom))) == Approx(2 * half).margin(2 * sideways * sideways));
  CHECK(top.dot(view.cast<float>()) == Approx(bottom.dot(view.cast<float>())));
}

TEST_CASE("a point on a camera ray is seen where the ray came from, with and without a lens") {
  for (const double aperture : {0.0, 0.05}) {
    CameraRays camera(tilted(aperture), wide());
    camera.place(Vec3(0.5, -1, 2), 0);
    for (int i = 0; i < 500; ++i) {
      const int x = i % 60, y = i * 7 % 40;
      const Sample2 film = random_pair(1, i), lens = random_pair(2, i);
      const CameraRay ray = camera.ray(x, y, film, lens);
      CameraSight sight;
      REQUIRE(ray.direction.norm() == Approx(1).epsilon(1e-6));
      REQUIRE(camera.see(ray.origin + 1.7f * ray.direction, lens, sight));
      REQUIRE(sight.x == Approx(x + 0.5 + camera.filter().sample(film.u)).margin(2e-3));
      REQUIRE(sight.y == Approx(y + 0.5 + camera.filter().sample(film.v)).margin(2e-3));
      REQUIRE(sight.distance == Approx(1.7).epsilon(1e-5));
      REQUIRE((sight.direction + ray.direction).norm() < 1e-5f);
      REQUIRE_FALSE(camera.see(ray.origin - 1.7f * ray.direction, lens, sight));
    }
  }
}

// Rays of all film points from one point of the lens meet in the plane that is sharp; 1 / distance apart of
// it they spread over a disc of aperture |d - focus| / focus.
TEST_CASE("a lens is sharp at its focus and blurs by the thin lens's law elsewhere") {
  Camera described = tilted(0.05);
  described.focus = 2.5;
  ImageSettings image = wide();
  image.filter = FilterKind::box;
  image.filter_width = 1e-6;
  CameraRays camera(described, image);
  const Vec3f forward = (described.target - described.position).normalized().cast<float>();
  const auto at_depth = [&](const CameraRay& ray, float depth) {
    const float before = forward.dot(ray.origin - described.position.cast<float>());
    return Vec3f(ray.origin + ray.direction * ((depth - before) / forward.dot(ray.direction)));
  };
  const Vec3f sharp = at_depth(camera.ray(10, 30, {0.5f, 0.5f}, {0, 0}), 2.5f);
  Vec3f middle = Vec3f::Zero();
  float widest = 0;
  for (int i = 0; i < 1000; ++i)
    middle += at_depth(camera.ray(10, 30, {0.5f, 0.5f}, random_pair(3, i)), 4) / 1000;
  for (int i = 0; i < 1000; ++i) {
    const CameraRay ray = camera.ray(10, 30, {0.5f, 0.5f}, random_pair(3, i));
    REQUIRE((at_depth(ray, 2.5f) - sharp).norm() < 1e-5f);
    REQUIRE((ray.origin - described.position.cast<float>()).norm() <= 0.05001f);
    widest = std::max(widest, (at_depth(ray, 4) - middle).norm());
  }
  CHECK(widest == Approx(0.05 * 1.5 / 2.5).epsilon(0.05));
}

// The density of film points over directions is the inverse of the solid angle of a pixel, here by the angle
// between rays to its corners.
TEST_CASE("film_density is what one over the solid angle of a pixel is") {
  ImageSettings image = wide();
  image.filter = FilterKind::box;
  CameraRays camera(tilted(0), image);
  for (const auto& [x, y] : {std::pair(30, 20), std::pair(0, 0), std::pair(59, 20)}) {
    const auto corner = [&, x = x, y = y](float u, float v) -> Vec3 {
      return camera.ray(x, y, {u, v}, {0, 0}).direction.cast<double>();
    };
    const Vec3 across = corner(0.9999999f, 0.5f) - corner(0, 0.5f);
    const Vec3 down = corner(0.5f, 0.9999999f) - corner(0.5f, 0);
    const double solid_angle = across.cross(down).norm();
    CHECK(camera.film_density(corner(0.5f, 0.5f).cast<float>()) == Approx(1 / solid_angle).epsilon(2e-3));
  }
  CHECK(camera.film_density(Vec3f(0, 0, 1)) == 0);
}

TEST_CASE("a camera with key frames goes straight between them and rests outside") {
  Camera camera = tilted(0);
  camera.motion = {{1, Vec3(0, 0, 4), Vec3::Zero()}, {3, Vec3(2, 0, 4), Vec3(2, 0, 0)}};
  CameraRays rays(camera, wide());
  for (const auto& [time, x] :
       {std::pair(0.0, 0.f), std::pair(2.0, 1.f), std::pair(2.5, 1.5f), std::pair(9.0, 2.f)}) {
    rays.place(Vec3::Zero(), time);
    CHECK((rays.ray(30, 20, {0, 0}, {0, 0}).origin - Vec3f(x, 0, 4)).norm() < 1e-6f);
    CameraSight sight;
    REQUIRE(rays.see(Vec3f(x, 0, 0), {0, 0}, sight));
    CHECK(sight.x == Approx(30).margin(1e-3));
  }
}

TEST_CASE("a camera that cannot see is a usage Error") {
  const auto refused = [](const Camera& camera, const ImageSettings& image) {
    try {
      CameraRays rays(camera, image);
    } catch (const Error& error) {
      return error.code() == ErrorCode::usage;
    }
    return false;
  };
  Camera nowhere = tilted(0), flat = tilted(0), along = tilted(0), key = tilted(0), closed = tilted(-1);
  nowhere.target = nowhere.position;
  flat.fov = 180;
  along.up = along.target - along.position;
  key.motion = {{0, Vec3(0, 0, 4), Vec3(0, 0, 4)}};
  ImageSettings empty = wide(), pointed = wide();
  empty.width = 0;
  pointed.filter_width = 0;
  CHECK_FALSE(refused(tilted(0), wide()));
  for (const Camera* camera : {&nowhere, &flat, &along, &key, &closed}) CHECK(refused(*camera, wide()));
  CHECK(refused(tilted(0), empty));
  CHECK(refused(tilted(0), pointed));
}

}  // namespace firn::test::camera
