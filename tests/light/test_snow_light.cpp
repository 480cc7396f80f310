// SPDX-License-Identifier: MIT
// Light inside the snow itself: energy, similarity, tint and glints in the mean, bits.
#include <cmath>

#include "tests/catch.h"
#include "tests/light/estimate.h"

namespace firn::test::snow_light {
namespace {

constexpr double kRadius = 0.15, kSpacing = 0.01;

Snapshot ball() { return snowball(Vec3::Zero(), kRadius, kSpacing); }

// The whole ball and a little beside it, in light from one side and some from all.
RenderSetup lit_ball(int samples) {
  RenderSetup setup = empty_setup(Vec3(0, 0.1, 1.2), Vec3::Zero(), 17, 24, samples, 1000000);
  setup.image.snow_light = SnowLight::inside;
  setup.snow[0].density = 300;
  setup.snow[0].extinction = 2;  // mean free path 1.7 mm
  setup.lights.push_back(SunLight{Vec3(1, 1, 1), 2, Vec3f::Constant(2)});
  setup.lights.push_back(ConstantLight{Vec3f::Constant(0.3f)});
  return setup;
}

// Mean radiance of the picture's middle, which the ball fills, over seeds.
struct Colour {
  Vec3 mean = Vec3::Zero(), error = Vec3::Zero();
};
Colour middle(RenderSetup setup, int seeds, Layer layer = Layer::beauty) {
  if (layer != Layer::beauty) setup.layers = {layer};
  const Snapshot snow = ball();
  const auto pictures = side_by_side(static_cast<std::size_t>(seeds), [&](std::size_t seed) -> Vec3 {
    RenderSetup its = setup;
    its.seed = 100 + seed;
    const Picture picture = render(snow, its);
    const std::vector<float>& values = layer == Layer::beauty ? picture.rgb : picture.layers[0].values;
    Vec3 seen = Vec3::Zero();
    for (int y = 6; y < 18; ++y) {
      for (int x = 6; x < 18; ++x) {
        for (int c = 0; c < 3; ++c) seen[c] += values[3 * (24 * y + x) + c] / 144.0;
      }
    }
    return seen;
  });
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (const Vec3& seen : pictures) sum += seen, squares += seen.cwiseProduct(seen);
  const Vec3 mean = sum / seeds;
  return {mean, ((squares / seeds - mean.cwiseProduct(mean)).cwiseMax(0.0) / (seeds - 1)).cwiseSqrt()};
}

void check_same(const Colour& a, const Colour& b, double bias) {
  for (int c = 0; c < 3; ++c) {
    INFO(a.mean[c] << " +- " << a.error[c] << " and " << b.mean[c] << " +- " << b.error[c]);
    CHECK(std::fabs(a.mean[c] - b.mean[c]) < 4.5 * std::hypot(a.error[c], b.error[c]) + bias * a.mean[c]);
  }
}

}  // namespace

TEST_CASE("in a white furnace snow that absorbs nothing cannot be seen through its walks either",
          "[light][slow]") {
  for (const SnowShape shape : {SnowShape::smooth, SnowShape::spheres}) {
    for (const Integrator integrator : {Integrator::path, Integrator::bidirectional}) {
      RenderSetup setup = lit_ball(32);
      setup.image.snow = shape;
      setup.image.integrator = integrator;
      setup.image.width = setup.image.height = 24;
      setup.snow[0].ice_per_collision = 0;
      setup.lights = {ConstantLight{Vec3f::Ones()}};
      const Colour seen = middle(setup, 8);
      INFO(seen.mean.transpose() << " +- " << seen.error.transpose());
      CHECK(std::fabs(seen.mean.y() - 1) < std::max(4 * seen.error.y(), 1e-3));
      setup.snow[0].albedo = Vec3f::Constant(0.8f);
      CHECK(middle(setup, 2).mean.y() < 0.9);
    }
  }
}

TEST_CASE("pictures with light inside the snow tell its mass and what the surface leaves of it", "[light]") {
  const Snapshot snow = ball();
  double mass = 0;
  for (const float volume : snow.volume0) mass += 300. * volume;
  for (const SnowLight light : {SnowLight::inside, SnowLight::surface}) {
    RenderSetup setup = lit_ball(1);
    setup.image.snow_light = light;
    setup.image.width = setup.image.height = 4;
    FrameTracer renderer(*supported_kernels().back(), setup);
    Picture picture;
    RenderStats stats;
    REQUIRE(renderer.render(snow, picture, stats));
    const bool inside = light == SnowLight::inside;
    CHECK(stats.snow_mass == Approx(inside ? mass : 0).epsilon(1e-4));
    CHECK(stats.medium_mass <= stats.snow_mass);
    CHECK(stats.medium_mass >= 0.9 * stats.snow_mass);
  }
}

TEST_CASE("similarity deep in the snow changes its light by less than 1 %", "[light]") {
  RenderSetup setup = lit_ball(32);
  const Colour reduced = middle(setup, 12);
  setup.image.reference = true;
  const Colour reference = middle(setup, 12);
  check_same(reference, reduced, 0.01);
}

TEST_CASE("snows that scatter by different means are left as they are", "[light]") {
  RenderSetup setup = lit_ball(4);
  Snapshot snow = ball();
  for (std::size_t i = 0; i < snow.size(); ++i) snow.object[i] = snow.position[0][i] > 0;
  setup.snow.push_back(setup.snow[0]);
  const auto picture = [&](bool reference, double second) {
    setup.image.reference = reference;
    setup.snow[1].anisotropy = second;
    return render(snow, setup).rgb;
  };
  const double first = setup.snow[0].anisotropy;
  CHECK(picture(false, 0.3) == picture(true, 0.3));
  CHECK(picture(false, first) != picture(true, first));
}

TEST_CASE("tint and glints are the same in the mean for any number of samples and lights", "[light]") {
  RenderSetup setup = lit_ball(16);
  setup.snow[0].ice_per_collision = 5e-3;  // strong
  setup.snow[0].sparkle.density = 1e5;
  setup.snow[0].sparkle.size = 2e-3;
  setup.snow[0].sparkle.roughness = 10;
  const Colour few = middle(setup, 12), glints = middle(setup, 12, Layer::sparkle);
  CHECK(few.mean.x() < 0.97 * few.mean.z());  // blue
  CHECK(glints.mean.y() > 10 * glints.error.y());
  setup.image.samples = 32;
  check_same(few, middle(setup, 12), 0);
  check_same(glints, middle(setup, 12, Layer::sparkle), 0);
  // Two suns of half the light each.
  std::get<SunLight>(setup.lights[0]).irradiance *= 0.5f;
  setup.lights.push_back(setup.lights[0]);
  check_same(few, middle(setup, 12), 0);
  check_same(glints, middle(setup, 12, Layer::sparkle), 0);
}

TEST_CASE("light inside the snow has the same bits for 1, 2 and 4 threads and for AVX2 and AVX-512",
          "[light]") {
  RenderSetup setup = lit_ball(2);
  setup.image.integrator = Integrator::bidirectional;
  setup.snow[0].sparkle.density = 1e5;
  require_same_bits(ball(), setup);
}

}  // namespace firn::test::snow_light
