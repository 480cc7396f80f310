// SPDX-License-Identifier: MIT
// The preview: what it says of snow whose light is known, how near it is to the path tracer, and its bits.
#include <algorithm>
#include <cmath>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/render/preview/ambient.h"
#include "src/render/sampling/directions.h"
#include "src/render/snow/snow_grain.h"
#include "tests/catch.h"
#include "tests/light/pictures.h"
#include "tests/points.h"

namespace firn::test::preview {
namespace {

constexpr double kSpacing = 0.01;  // m

// A jittered lattice that fills a box about the origin.
Snapshot block(int across, int high) {
  Points points(2 * kSpacing);
  std::uint64_t key = 0;
  for (int i = 0; i < across * across * high; ++i) {
    const int at[3] = {i % across, i / across % high, i / across / high};
    const int count[3] = {across, high, across};
    Vec3 place;
    for (int a = 0; a < 3; ++a) {
      const double jitter = 0.5 * (uniform_double(hash_keys(11, key++)) - 0.5);
      place[a] = kSpacing * (at[a] + 0.5 - 0.5 * count[a] + jitter);
    }
    points.add(place, kSpacing * kSpacing * kSpacing);
  }
  return points.snapshot();
}

RenderSetup preview_setup(const Vec3& position, double fov, int size) {
  RenderSetup setup = empty_setup(position, Vec3::Zero(), fov, size, 1, 1);
  setup.image.integrator = Integrator::preview;
  setup.snow[0].density = 300;
  return setup;
}

constexpr double kElevation = 0.8;  // sine of the sun's
SunLight low_sun() { return {Vec3(0.6, kElevation, 0), 0.2666, Vec3f(3, 2, 1)}; }

RenderSetup sunlit_ball() {
  RenderSetup setup = preview_setup(Vec3(0.3, 0.3, 1.1), 18, 64);
  setup.lights = {
      SunLight{Vec3(1, 1, 1), 0.2666, Vec3f::Constant(2)},
      SkyLight{Vec3f(0.12f, 0.24f, 0.52f), Vec3f(0.42f, 0.52f, 0.68f), Vec3f(0.25f, 0.27f, 0.3f)}};
  return setup;
}

}  // namespace

TEST_CASE(
    "a layer of snow keeps the light that ice does not absorb, and a deep one is as bright as its grain") {
  SnowLook look;
  look.anisotropy = 0.8;
  for (const double depth : {0., 0.3, 2., 30., 1e4}) {
    look.ice_per_collision = 1e-14;
    const SnowLayer clear = snow_layer(look, IceSource::picard, depth);
    for (int c = 0; c < 3; ++c) {
      CHECK(clear.passed[c] == Approx(1 / (1 + 0.75 * depth)).epsilon(1e-4));
      CHECK(clear.reflected[c] + clear.passed[c] == Approx(1).epsilon(1e-4));
    }
  }
  look.ice_per_collision = ice_per_collision(5e-4);
  const SnowLayer deep = snow_layer(look, IceSource::picard, 1e6);
  const SnowLayers table({look}, IceSource::picard);
  for (int c = 0; c < 3; ++c) {
    CHECK(deep.reflected[c] == Approx(layer_reflectance(look, IceSource::picard)[c]).epsilon(1e-5));
    for (const double column : {0.01, 0.5, 7., 90.}) {
      const SnowLayer exact =
          snow_layer(look, IceSource::picard, column * look.extinction * (1 - look.anisotropy));
      const SnowLayer near = table.of(0, static_cast<float>(column));
      CHECK(near.reflected[c] == Approx(exact.reflected[c]).margin(2e-3));
      CHECK(near.passed[c] == Approx(exact.passed[c]).margin(2e-3));
    }
  }
}

TEST_CASE("light from all around falls on a plane as quadrature has it") {
  const std::vector<Light> even = {ConstantLight{Vec3f(1, 2, 3)}};
  const std::vector<Light> sky = {
      SkyLight{Vec3f(0.12f, 0.24f, 0.52f), Vec3f(0.42f, 0.52f, 0.68f), Vec3f(0.25f, 0.27f, 0.3f)}};
  const ObjectSet none(supported_kernels().back()->trace, {}, {});
  const AmbientLight constant(LightSet(even, none)), gradient(LightSet(sky, none));
  const LightSet lights(sky, none);
  // What order 2 leaves out is order 4, of which a cosine lobe keeps 1/24 of what it keeps of order 0.
  Vec3 even_part = Vec3::Zero();  // irradiance by the mean radiance
  constexpr int kRows = 1000;
  for (int k = 0; k < kRows; ++k) {
    const float y = 1 - 2 * (static_cast<float>(k) + 0.5f) / kRows;
    even_part += lights.sky(Vec3f(std::sqrt(1 - y * y), y, 0)).cast<double>() * kPi / kRows;
  }
  for (const Vec3f& n : {Vec3f(0, 1, 0), Vec3f(0, -1, 0), Vec3f(1, 0, 0), Vec3f(0.6f, 0.48f, -0.64f)}) {
    Vec3 sum = Vec3::Zero();
    constexpr int kSide = 200;
    for (int k = 0; k < kSide * kSide; ++k) {
      const Sample2 at{(static_cast<float>(k / kSide) + 0.5f) / kSide,
                       (static_cast<float>(k % kSide) + 0.5f) / kSide};
      sum += lights.sky(cosine_direction(n, at)).cast<double>();
    }
    for (int c = 0; c < 3; ++c) {
      CHECK(constant.irradiance(n)[c] == Approx(kPi * static_cast<float>(c + 1)).epsilon(2e-3));
      CHECK(std::fabs(gradient.irradiance(n)[c] - kPi * sum[c] / (kSide * kSide)) < 0.03 * even_part[c]);
    }
  }
}

TEST_CASE("a flat bed in the sun is a matt layer, and black in the shadow of a thing") {
  RenderSetup setup = preview_setup(Vec3(0, 1, 0), 8, 48);
  setup.lights = {low_sun()};
  const Snapshot bed = block(50, 10);
  const Vec3f lit = mean(render(bed, setup));
  const Vec3f layer = layer_reflectance(setup.snow[0], setup.image.ice);
  for (int c = 0; c < 3; ++c)
    CHECK(lit[c] == Approx(layer[c] * low_sun().irradiance[c] * kElevation / kPi).epsilon(0.03));
  Shape roof;  // between bed and sun, out of sight
  roof.form = Box{Vec3(0.3, 0.01, 0.3)};
  roof.pose.translation = Vec3(0.6, 0.8, 0);
  add_object(setup, roof, add_surface(setup, SurfaceKind::diffuse, 0));
  CHECK(mean(render(bed, setup)).maxCoeff() < 1e-3f * lit.minCoeff());
}

TEST_CASE("a sheet lit from behind lets through what diffusion does, in its colour") {
  RenderSetup setup = preview_setup(Vec3(0, 1, 0), 8, 32);
  setup.lights = {SunLight{Vec3(0, -1, 0), 0.2666, Vec3f::Constant(3)}};
  setup.snow[0].ice_per_collision = ice_per_collision(1e-3);
  setup.snow[0].extinction = snow_extinction(1e-3);
  constexpr int kHigh = 12;
  const Vec3f seen = mean(render(block(50, kHigh), setup));
  const double depth = setup.snow[0].extinction * 300 * kHigh * kSpacing * (1 - setup.snow[0].anisotropy);
  const SnowLayer layer = snow_layer(setup.snow[0], setup.image.ice, depth);
  INFO(seen.transpose() << " and " << (layer.passed * 3 / kPi).transpose());
  for (int c = 0; c < 3; ++c) CHECK(seen[c] == Approx(layer.passed[c] * 3 / kPi).epsilon(0.25));
  CHECK(seen.z() / seen.x() == Approx(layer.passed.z() / layer.passed.x()).epsilon(0.02));
  CHECK(layer.passed.z() > 1.03f * layer.passed.x());
}

TEST_CASE("a ball in sun and sky is about as bright as paths of light make it") {
  const Snapshot ball = snowball(Vec3::Zero(), 0.15, kSpacing);
  RenderSetup setup = sunlit_ball();
  const Vec3f estimate = mean(render(ball, setup));
  setup.image.integrator = Integrator::path;
  setup.image.samples = 64;
  setup.image.max_bounces = 1000000;
  const Vec3f path = mean(render(ball, setup));
  INFO("preview " << estimate.transpose() << ", path " << path.transpose());
  for (int c = 0; c < 3; ++c) CHECK(estimate[c] == Approx(path[c]).epsilon(0.05));
}

TEST_CASE("the preview glints, and snow that stands still glints the same in every frame") {
  RenderSetup setup = sunlit_ball();
  setup.snow[0].sparkle.density = 1e6;
  setup.snow[0].sparkle.size = 5e-4;
  setup.layers = {Layer::sparkle};
  Snapshot ball = snowball(Vec3::Zero(), 0.15, kSpacing);
  const Picture first = render(ball, setup);
  ball.frame = 7;
  ball.time = 0.3;
  setup.seed = 5;
  setup.image.samples = 9;
  const Picture later = render(ball, setup);
  CHECK(hash(first) == hash(later));
  const std::vector<float>& sparkle = first.layers[0].values;
  CHECK(*std::max_element(sparkle.begin(), sparkle.end()) > 0.05f);
  CHECK(std::count(sparkle.begin(), sparkle.end(), 0.f) > static_cast<std::ptrdiff_t>(sparkle.size() / 2));
}

TEST_CASE("the preview has the same bits for any threads and instruction set, and from a camera that moves") {
  RenderSetup setup = sunlit_ball();
  setup.snow[0].sparkle.density = 1e6;
  add_object(setup, floor_plane(-0.15), add_surface(setup, SurfaceKind::diffuse, 0.4f));
  Shape box;
  box.form = Box{Vec3::Constant(0.05)};
  box.pose.translation = Vec3(0.2, -0.1, 0.1);
  add_object(setup, box, add_surface(setup, SurfaceKind::mirror, 0.9f));
  setup.lights.push_back(SphereLight{Vec3(-0.3, 0.3, 0.2), 0.05, Vec3f::Constant(10)});
  const Snapshot ball = snowball(Vec3::Zero(), 0.15, kSpacing);
  require_same_bits(ball, setup);

  RenderSetup before = setup;
  before.camera.position = Vec3(0.8, 0.4, 0.7);
  FrameTracer renderer(*supported_kernels().back(), before);
  Picture picture;
  RenderStats stats;
  REQUIRE(renderer.render(ball, picture, stats));
  CHECK(hash(picture) != hash(render(ball, setup)));
  REQUIRE(renderer.look_again(ball, setup.camera, picture, stats));
  CHECK(hash(picture) == hash(render(ball, setup)));
}

TEST_CASE("the preview draws scenes without snow, spheres, and refuses media") {
  RenderSetup setup = sunlit_ball();
  add_object(setup, floor_plane(-0.15), add_surface(setup, SurfaceKind::glossy, 0.4f));
  CHECK(mean(render(Snapshot{}, setup)).minCoeff() > 0.05f);
  const Snapshot ball = snowball(Vec3::Zero(), 0.15, kSpacing);
  const Vec3f smooth = mean(render(ball, setup));
  setup.image.snow = SnowShape::spheres;
  CHECK((mean(render(ball, setup)) - smooth).norm() < 0.2f * smooth.norm());
  setup.media.emplace_back();
  setup.media.back().shape.form = Ball{0.1};
  CHECK_THROWS_AS(FrameTracer(*supported_kernels().back(), setup), Error);
}

}  // namespace firn::test::preview
