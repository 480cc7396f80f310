// SPDX-License-Identifier: MIT
// Laws of light: energy, irradiance in closed form, mirrors, shadows, bounces.
#include <cmath>

#include "tests/catch.h"
#include "tests/light/estimate.h"
#include "tests/light/pictures.h"

namespace firn::test::transport {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Irradiance on a floor of albedo 0.5 at `point`, measured by a camera that sees little else.
double irradiance_at(RenderSetup setup, const Vec3& point, int samples = 4096) {
  setup.camera.position = point + Vec3(0.2, 0.3, 0.1);
  setup.camera.target = point;
  setup.camera.fov = 0.01;
  setup.image = {1, 1, samples, 0};
  return render(Snapshot{}, setup).rgb[1] * kPi / 0.5;
}

RenderSetup grey_floor() {
  RenderSetup setup = empty_setup(Vec3(0, 1, 0), Vec3::Zero(), 10, 1, 1, 0);
  add_object(setup, floor_plane(0), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  return setup;
}

}  // namespace

TEST_CASE("in a white furnace white snow and white things cannot be seen") {
  RenderSetup setup = empty_setup(Vec3(0.5, 0.4, 1), Vec3::Zero(), 35, 24, 256, 400);
  setup.snow[0].ice_per_collision = 0;
  setup.layers = {Layer::variance};
  setup.lights.push_back(ConstantLight{Vec3f::Ones()});
  Shape ball;
  ball.form = Ball{0.1};
  ball.pose.translation = Vec3(0.28, 0, 0);
  add_object(setup, ball, add_surface(setup, SurfaceKind::diffuse, 1));
  ball.pose.translation = Vec3(-0.28, 0, 0);
  add_object(setup, ball, add_surface(setup, SurfaceKind::mirror, 1));
  const Picture film = render(snowball(Vec3::Zero(), 0.15, 0.015), setup);
  Scores scores;
  for (std::size_t k = 0; k < film.layers[0].values.size(); ++k) {
    const float variance = film.layers[0].values[k], value = film.rgb[3 * k + 1];
    REQUIRE(value == Approx(1).margin(0.05));
    if (variance > 1e-10f) scores.add(value, 1, std::sqrt(variance));
  }
  CHECK(scores.largest() < 4.5);
  CHECK(mean(film).y() == Approx(1).margin(1e-3));
}

TEST_CASE("in a white furnace grey snow is darker than its surroundings and lighter than one reflection") {
  RenderSetup setup = empty_setup(Vec3(0, 0, 1), Vec3::Zero(), 5, 8, 64, 100);
  setup.snow[0].albedo = Vec3f(0.8f, 0.8f, 0.8f);
  setup.lights.push_back(ConstantLight{Vec3f::Ones()});
  const float seen = mean(render(snowball(Vec3::Zero(), 0.15, 0.015), setup)).y();
  CHECK(seen <= 0.8001f);
  CHECK(seen > 0.6f);
}

TEST_CASE("a quad above a floor gives the irradiance of the closed form") {
  RenderSetup setup = grey_floor();
  // 0.8 x 0.6 at height 0.5, shining down.
  setup.lights.push_back(
      QuadLight{Vec3(-0.4, 0.5, -0.3), Vec3(0.8, 0, 0), Vec3(0, 0, 0.6), Vec3f::Constant(3)});
  const double x = 0.4 / 0.5, y = 0.3 / 0.5;
  const double corner = (x / std::sqrt(1 + x * x) * std::atan(y / std::sqrt(1 + x * x)) +
                         y / std::sqrt(1 + y * y) * std::atan(x / std::sqrt(1 + y * y))) /
                        (2 * kPi);
  // The light faces edge_u x edge_v = -Y, down to the floor.
  CHECK(irradiance_at(setup, Vec3::Zero()) == Approx(4 * corner * kPi * 3).epsilon(0.01));
  // From behind it is dark.
  auto& quad = std::get<QuadLight>(setup.lights[0]);
  std::swap(quad.edge_u, quad.edge_v);
  CHECK(irradiance_at(setup, Vec3::Zero(), 64) == 0);
}

TEST_CASE("a ball of light gives pi L (r/d)^2 cos") {
  RenderSetup setup = grey_floor();
  setup.lights.push_back(SphereLight{Vec3(0.3, 0.6, 0.2), 0.15, Vec3f::Constant(5)});
  const double d2 = 0.09 + 0.36 + 0.04;
  CHECK(irradiance_at(setup, Vec3::Zero()) ==
        Approx(kPi * 5 * 0.15 * 0.15 / d2 * 0.6 / std::sqrt(d2)).epsilon(0.005));
}

TEST_CASE("the sun gives its irradiance times the cosine, whatever its disc") {
  for (const double radius : {0.0, 0.2666, 5.0}) {
    RenderSetup setup = grey_floor();
    setup.lights.push_back(SunLight{Vec3(1, 2, 0.5), radius, Vec3f::Constant(4)});
    CHECK(irradiance_at(setup, Vec3(3, 0, 1)) == Approx(4 * 2 / std::sqrt(5.25)).epsilon(0.005));
  }
}

TEST_CASE("the sun seen directly has the radiance that its irradiance implies") {
  RenderSetup setup = empty_setup(Vec3::Zero(), Vec3(1, 1, 0), 0.5, 1, 256, 0);
  setup.lights.push_back(SunLight{Vec3(1, 1, 0), 2.0, Vec3f::Constant(4)});
  const double sine = std::sin(2 * kPi / 180);
  CHECK(render(Snapshot{}, setup).rgb[0] == Approx(4 / (kPi * sine * sine)).epsilon(1e-4));
}

TEST_CASE("several lights add up") {
  RenderSetup setup = grey_floor();
  setup.lights.push_back(SphereLight{Vec3(0.3, 0.6, 0.2), 0.15, Vec3f::Constant(5)});
  const double ball = irradiance_at(setup, Vec3::Zero());
  setup.lights.push_back(SunLight{Vec3(0, 1, 0), 0.2666, Vec3f::Constant(2)});
  setup.lights.push_back(QuadLight{Vec3(1, 3, -2), Vec3(4, 0, 0), Vec3(0, 0, 4), Vec3f::Constant(0.1f)});
  auto alone = grey_floor();
  alone.lights.push_back(setup.lights.back());
  CHECK(irradiance_at(setup, Vec3::Zero(), 16384) ==
        Approx(ball + 2 + irradiance_at(alone, Vec3::Zero())).epsilon(0.01));
}

TEST_CASE("a mirror shows what lies in the mirrored direction, tinted by its albedo") {
  RenderSetup setup = empty_setup(Vec3(0, 1, 2), Vec3(0, 0, 0), 1, 4, 16, 2);
  add_object(setup, floor_plane(0), add_surface(setup, SurfaceKind::mirror, 0.8f));
  Shape lamp;
  lamp.form = Ball{0.3};
  lamp.pose.translation = Vec3(0, 1, -2);
  add_object(setup, lamp, add_surface(setup, SurfaceKind::emission, 5));
  const Picture film = render(Snapshot{}, setup);
  for (const float value : film.rgb) REQUIRE(value == Approx(4));
}

TEST_CASE("a mirror shows lamps and the sun") {
  RenderSetup setup = empty_setup(Vec3(0, 1, 2), Vec3(0, 0, 0), 1, 4, 16, 2);
  add_object(setup, floor_plane(0), add_surface(setup, SurfaceKind::mirror, 0.5f));
  setup.lights.push_back(SphereLight{Vec3(0, 1, -2), 0.3, Vec3f::Constant(6)});
  for (const float value : render(Snapshot{}, setup).rgb) REQUIRE(value == Approx(3));
}

TEST_CASE("sun that a mirror throws on a matt floor is in `reference` and bidirectional, and not in `path`") {
  // A wall that mirrors, and a sun of 10 degrees at 45 over the floor before it, which it lights twice.
  RenderSetup setup = empty_setup(Vec3(0.3, 0.6, 0.2), Vec3(0.1, 0, 0), 10, 16, 1024, 1);
  add_object(setup, floor_plane(0), add_surface(setup, SurfaceKind::diffuse, 0.5f));
  Shape wall;
  wall.form = Box{Vec3(0.05, 0.5, 0.5)};
  wall.pose.translation = Vec3(-0.25, 0.5, 0);
  add_object(setup, wall, add_surface(setup, SurfaceKind::mirror, 0.9f));
  setup.lights.push_back(SunLight{Vec3(1, 1, 0), 10, Vec3f::Constant(2)});
  setup.image.light_bounces = 2;
  const double once = 0.5 / kPi * 2 * std::sqrt(0.5);
  const auto check = [&](Integrator integrator, bool reference, double times) {
    setup.image.integrator = integrator;
    setup.image.reference = reference;
    const Estimate seen = channel_of(render(Snapshot{}, setup), 1);
    INFO(name_of(integrator) << ", reference " << reference << ": " << seen.mean / once << " +- "
                             << seen.error / once << " times the sun, expected " << times);
    CHECK(std::fabs(seen.mean - times * once) < 4.5 * seen.error);
    CHECK(seen.error < 0.02 * once);
  };
  check(Integrator::path, false, 1);
  check(Integrator::path, true, 1.9);
  check(Integrator::bidirectional, false, 1.9);
  check(Integrator::bidirectional, true, 1.9);
}

TEST_CASE("the edge of a shadow is as soft as the sun is wide") {
  // A wall's top edge at (0, 1): the sun, 5 degrees in radius, stands at 45 degrees behind it.
  RenderSetup setup = grey_floor();
  Shape wall;
  wall.form = Box{Vec3(0.5, 0.5, 50)};
  wall.pose.translation = Vec3(-0.5, 0.5, 0);
  add_object(setup, wall, 0);
  setup.lights.push_back(SunLight{Vec3(-1, 1, 0), 5, Vec3f::Constant(2)});
  const double full = 2 * std::sqrt(0.5);
  const auto reach = [](double degrees) { return 1 / std::tan((45 + degrees) * kPi / 180); };
  CHECK(irradiance_at(setup, Vec3(reach(5.2), 0, 0)) == 0);
  CHECK(irradiance_at(setup, Vec3(reach(0), 0, 0)) == Approx(0.5 * full).epsilon(0.05));
  CHECK(irradiance_at(setup, Vec3(reach(-5.2), 0, 0)) == Approx(full).epsilon(0.005));
  const double quarter = irradiance_at(setup, Vec3(reach(2.5), 0, 0));
  CHECK(quarter > 0.1 * full);
  CHECK(quarter < 0.35 * full);
}

TEST_CASE("snow throws a shadow") {
  RenderSetup setup = grey_floor();
  setup.lights.push_back(SunLight{Vec3(0, 1, 0), 0.2666, Vec3f::Constant(2)});
  setup.camera = {Vec3(0.2, 0.3, 0.1), Vec3::Zero(), Vec3(0, 1, 0), 0.01};
  setup.image = {1, 1, 16, 0};
  CHECK(render(snowball(Vec3(0, 0.6, 0), 0.1, 0.01), setup).rgb[1] == 0);
  CHECK(render(snowball(Vec3(0.2, 0.6, -0.2), 0.1, 0.01), setup).rgb[1] ==
        Approx(0.5 * 2 / kPi).epsilon(0.001));
}

TEST_CASE("each bounce inside a white-washed ball adds its term of the geometric series") {
  // Integrating sphere: direct light a L (r/R)^2 on the wall, then a factor a a bounce.
  for (const int bounces : {0, 1, 2, 5}) {
    RenderSetup setup = empty_setup(Vec3(0.5, 0, 0), Vec3(0.5, 0, 1), 40, 4, 1024, bounces);
    Shape room;
    room.form = Ball{1};
    add_object(setup, room, add_surface(setup, SurfaceKind::diffuse, 0.7f));
    setup.lights.push_back(SphereLight{Vec3::Zero(), 0.02, Vec3f::Constant(1000)});
    double series = 0, term = 0.7 * 1000 * 0.02 * 0.02;
    for (int k = 0; k <= bounces; ++k, term *= 0.7) series += term;
    CHECK(mean(render(Snapshot{}, setup)).y() == Approx(series).epsilon(0.01));
  }
}

TEST_CASE("roulette does not change the mean") {
  RenderSetup setup = empty_setup(Vec3(0.5, 0, 0), Vec3(0.5, 0, 1), 40, 4, 1024, 60);
  Shape room;
  room.form = Ball{1};
  add_object(setup, room, add_surface(setup, SurfaceKind::diffuse, 0.8f));
  setup.lights.push_back(SphereLight{Vec3::Zero(), 0.02, Vec3f::Constant(1000)});
  CHECK(mean(render(Snapshot{}, setup)).y() == Approx(0.8 * 0.4 / 0.2).epsilon(0.015));
}

TEST_CASE("sky light is smooth over the horizon and the zenith is the zenith") {
  RenderSetup setup = empty_setup(Vec3::Zero(), Vec3(0, 1, 0), 1, 1, 4, 0);
  setup.lights.push_back(SkyLight{Vec3f(0.1f, 0.2f, 0.4f), Vec3f(0.6f, 0.7f, 0.8f), Vec3f(0.3f, 0.2f, 0.1f)});
  CHECK(render(Snapshot{}, setup).rgb[2] == Approx(0.4).margin(1e-3));
  const auto towards = [&setup](double y) {
    setup.camera.target = Vec3(1, y, 0);
    setup.camera.up = Vec3(0, 1, 0);
    setup.camera.fov = 0.01;
    return render(Snapshot{}, setup).rgb[0];
  };
  CHECK(towards(1e-3) == Approx(towards(-1e-3)).margin(0.01));
  CHECK(towards(-1) == Approx(0.3));
}

}  // namespace firn::test::transport
