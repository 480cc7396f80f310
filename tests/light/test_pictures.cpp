// SPDX-License-Identifier: MIT
// Pictures as a whole: the same bits, the same place, no snow, early end, errors.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <stop_token>
#include <string>
#include <utility>

#include "firn/error.h"
#include "src/particles/snapshot.h"
#include "tests/catch.h"
#include "tests/light/pictures.h"
#include "tests/points.h"

namespace firn::test::pictures {
namespace {

// A snowball on a checkered floor with every kind of light and surface.
RenderSetup rich_setup(const Vec3& place) {
  RenderSetup setup = empty_setup(place + Vec3(0.5, 0.35, 0.8), place + Vec3(0, 0.1, 0), 35, 40, 4, 3);
  setup.image.width = 52;
  const int floor = add_surface(setup, SurfaceKind::diffuse, 0.4f);
  setup.surfaces[floor].checker = Vec3f::Constant(0.2f);
  Shape plane = floor_plane(0);
  plane.pose.translation += place;
  add_object(setup, plane, floor);
  Shape box;
  box.form = Box{Vec3::Constant(0.05)};
  box.pose.translation = place + Vec3(0.25, 0.05, 0.1);
  add_object(setup, box, add_surface(setup, SurfaceKind::mirror, 0.9f));
  Shape lamp;
  lamp.form = Cylinder{0.03, 0.05};
  lamp.pose.translation = place + Vec3(-0.25, 0.05, 0.1);
  add_object(setup, lamp, add_surface(setup, SurfaceKind::emission, 2));
  setup.lights.push_back(SunLight{Vec3(-1, 0.5, 0.6), 0.2666, Vec3f(3, 2.7f, 2.4f)});
  setup.lights.push_back(SkyLight{Vec3f(0.2f, 0.3f, 0.6f), Vec3f(0.5f, 0.6f, 0.8f), Vec3f::Constant(0.2f)});
  setup.lights.push_back(SphereLight{place + Vec3(0, 0.6, 0), 0.05, Vec3f::Constant(10)});
  setup.lights.push_back(
      QuadLight{place + Vec3(-0.5, 0.8, 0), Vec3(0.2, 0, 0), Vec3(0, 0, 0.2), Vec3f::Constant(5)});
  return setup;
}

void check_usage_error(RenderSetup setup) {
  try {
    FrameTracer renderer(*supported_kernels().front(), std::move(setup));
    FAIL("no error");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::usage);
  }
}

}  // namespace

TEST_CASE("a picture has the same bits for 1, 2 and 4 threads and for AVX2 and AVX-512") {
  require_same_bits(snowball(Vec3(0, 0.15, 0), 0.15, 0.012), rich_setup(Vec3::Zero()));
}

TEST_CASE("seed and frame change the noise, not the picture") {
  Snapshot snapshot = snowball(Vec3(0, 0.15, 0), 0.15, 0.02);
  RenderSetup setup = rich_setup(Vec3::Zero());
  setup.image.samples = 64;
  const Picture film = render(snapshot, setup);
  setup.seed = 2;
  const Picture other_seed = render(snapshot, setup);
  setup.seed = 1;
  snapshot.frame = 5;
  const Picture other_frame = render(snapshot, setup);
  CHECK(hash(film) != hash(other_seed));
  CHECK(hash(film) != hash(other_frame));
  CHECK((mean(film) - mean(other_seed)).norm() < 0.01f * mean(film).norm());
  CHECK((mean(film) - mean(other_frame)).norm() < 0.01f * mean(film).norm());
}

TEST_CASE("a picture 100 m from the world's origin is the picture at the origin") {
  // By whole cells of the render grid, which lies still in the world.
  const double cell = 1.6 * 0.012;
  const Vec3 far = cell * Vec3(5208, 0, -5208);
  const Picture near = render(snowball(Vec3(0, 0.15, 0), 0.15, 0.012), rich_setup(Vec3::Zero()));
  const Picture away = render(snowball(far + Vec3(0, 0.15, 0), 0.15, 0.012, far), rich_setup(far));
  std::size_t different = 0;
  for (std::size_t i = 0; i < near.rgb.size(); ++i) different += std::fabs(near.rgb[i] - away.rgb[i]) > 0.02f;
  CHECK(different < near.rgb.size() / 100);
  CHECK((mean(near) - mean(away)).norm() < 2e-3f * mean(near).norm());
}

TEST_CASE("a scene without snow is rendered") {
  const Picture film = render(Snapshot{}, rich_setup(Vec3::Zero()));
  CHECK(mean(film).y() > 0.05f);
  for (const float value : film.rgb) REQUIRE((std::isfinite(value) && value >= 0));
}

TEST_CASE("one particle is rendered") {
  Snapshot one = snowball(Vec3(0, 0.15, 0), 1e-9, 0.1);
  if (one.size() == 0) one = snowball(Vec3(0, 0.15, 0), 0.09, 0.1);
  REQUIRE(one.size() >= 1);
  one = test::resized(one, 1);
  const Picture with = render(one, rich_setup(Vec3::Zero())),
                without = render(Snapshot{}, rich_setup(Vec3::Zero()));
  CHECK(hash(with) != hash(without));
  for (const float value : with.rgb) REQUIRE((std::isfinite(value) && value >= 0));
}

TEST_CASE("the picture does not know the order of the particles") {
  const Snapshot snapshot = snowball(Vec3(0, 0.15, 0), 0.15, 0.02);
  Snapshot reversed = snapshot;
  for_each_stored_column(reversed, [](auto column) { std::reverse(column.begin(), column.end()); });
  const Picture a = render(snapshot, rich_setup(Vec3::Zero())),
                b = render(reversed, rich_setup(Vec3::Zero()));
  CHECK((mean(a) - mean(b)).norm() < 1e-3f * mean(a).norm());
}

TEST_CASE("rays are counted and a stopped frame says so") {
  Picture film;
  RenderStats stats;
  std::stop_source stop;
  RenderSetup setup = rich_setup(Vec3::Zero());
  FrameTracer renderer(*supported_kernels().back(), setup);
  const Snapshot snapshot = snowball(Vec3(0, 0.15, 0), 0.15, 0.02);
  CHECK(renderer.render(snapshot, film, stats, stop.get_token()));
  CHECK(film.width == 52);
  CHECK(film.height == 40);
  CHECK(stats.rays > 52u * 40u * 4u);
  CHECK(stats.grid_bytes > snapshot.size() * 16);
  stop.request_stop();
  CHECK_FALSE(renderer.render(snapshot, film, stats, stop.get_token()));
}

TEST_CASE("a camera that looks nowhere and a film without pixels are refused") {
  RenderSetup setup = rich_setup(Vec3::Zero());
  setup.camera.target = setup.camera.position;
  check_usage_error(setup);
  setup = rich_setup(Vec3::Zero());
  setup.camera.up = setup.camera.target - setup.camera.position;
  check_usage_error(setup);
  setup = rich_setup(Vec3::Zero());
  setup.image.width = 0;
  check_usage_error(setup);
  setup = rich_setup(Vec3::Zero());
  setup.objects[0].surface = 17;
  check_usage_error(setup);
}

}  // namespace firn::test::pictures
