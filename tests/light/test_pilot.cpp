// SPDX-License-Identifier: MIT
// integrator = "auto": the choice goes by work and error, and is the same everywhere.
#include "src/core/rng.h"
#include "src/render/pilot.h"
#include "tests/catch.h"
#include "tests/light/estimate.h"

namespace firn::test::pilot {
namespace {

// Small pictures as if by integrators of known noise and work.
struct Made {
  double deviation;    // of a value
  std::uint64_t rays;  // a picture
};
Choice choice_of(const RenderSetup& setup, const Made& path, const Made& bidirectional,
                 int* taken = nullptr) {
  return choose_integrator(setup, [&](const ImageSettings& image, std::uint64_t seed) {
    const Made& made = image.integrator == Integrator::path ? path : bidirectional;
    Shot shot;
    shot.work.rays = made.rays;
    shot.picture.width = image.width;
    shot.picture.height = image.height;
    for (int i = 0; i < 3 * image.width * image.height; ++i)
      shot.picture.rgb.push_back(1 + static_cast<float>(made.deviation) *
                                         (uniform_float(hash_keys(seed, i)) - 0.5f));
    if (taken) ++*taken;
    return shot;
  });
}

RenderSetup lamp_over_floor(bool to_the_ceiling) {
  RenderSetup setup = empty_setup(Vec3(0, 0.5, 1.5), Vec3(0, 0.3, 0), 40, 64, 16, 8);
  const int white = add_surface(setup, SurfaceKind::diffuse, 0.7f);
  for (const double height : {-0.05, 1.05}) {
    Shape box;
    box.form = Box{Vec3(0.6, 0.05, 0.6)};
    box.pose.translation = Vec3(0, height, 0);
    add_object(setup, box, white);
  }
  const Vec3 across(0.1, 0, 0), along(0, 0, 0.1);
  setup.lights.push_back(QuadLight{Vec3(0, 0.9, 0), to_the_ceiling ? along : across,
                                   to_the_ceiling ? across : along, Vec3f::Constant(10)});
  setup.image.integrator = Integrator::automatic;
  return setup;
}

}  // namespace

TEST_CASE("auto takes who needs less work for the same error, path where it hardly matters", "[light]") {
  RenderSetup setup = empty_setup(Vec3(0, 0, 1), Vec3::Zero(), 30, 64, 256, 8);
  CHECK(choice_of(setup, {0.2, 1000}, {0.1, 3000}).integrator == Integrator::bidirectional);  // 0.75
  CHECK(choice_of(setup, {0.2, 1000}, {0.1, 5000}).integrator == Integrator::path);           // 1.25
  CHECK(choice_of(setup, {0.2, 1000}, {0.2, 1000}).integrator == Integrator::path);
  CHECK(choice_of(setup, {0, 1000}, {0, 10}).integrator == Integrator::path);  // no noise at all
}

TEST_CASE("auto looks longer only where a glance does not tell, and not longer than the picture is worth",
          "[light]") {
  RenderSetup setup = empty_setup(Vec3(0, 0, 1), Vec3::Zero(), 30, 64, 256, 8);
  int clear = 0, close = 0, small = 0;
  choice_of(setup, {0.1, 1000}, {0.2, 1000}, &clear);
  CHECK(clear == 4);
  choice_of(setup, {0.1, 1000}, {0.11, 1000}, &close);
  CHECK(close > clear);
  setup.image.samples = 4;
  choice_of(setup, {0.1, 1000}, {0.11, 1000}, &small);
  CHECK(small == clear);
}

TEST_CASE("light tracing is a candidate only where its subpaths can be all of the path", "[light]") {
  RenderSetup setup = lamp_over_floor(false);
  CHECK(candidates(setup).size() == 2);
  setup.image.max_bounces = 4;
  setup.image.light_bounces = 5;
  CHECK(candidates(setup).back() == Integrator::light);
  add_surface(setup, SurfaceKind::mirror, 1);
  CHECK(candidates(setup).size() == 2);
}

TEST_CASE(
    "auto takes light from both ends for a lamp that shines on the ceiling, path for one over the floor",
    "[light]") {
  for (const bool to_the_ceiling : {false, true}) {
    FrameTracer renderer(*supported_kernels().back(), lamp_over_floor(to_the_ceiling));
    Picture picture;
    RenderStats stats;
    renderer.render({}, picture, stats);
    INFO(stats.choice.why);
    CHECK(stats.choice.integrator == (to_the_ceiling ? Integrator::bidirectional : Integrator::path));
    CHECK_FALSE(stats.choice.why.empty());
    // The picture is that of whom it chose.
    RenderSetup same = lamp_over_floor(to_the_ceiling);
    same.image.integrator = stats.choice.integrator;
    CHECK(render({}, same).rgb == picture.rgb);
  }
}

TEST_CASE("auto has the same bits for 1, 2 and 4 threads and for AVX2 and AVX-512", "[light]") {
  RenderSetup setup = lamp_over_floor(true);
  setup.image.snow_light = SnowLight::inside;
  setup.image.samples = 2;
  require_same_bits(snowball(Vec3(0, 0.2, 0), 0.1, 0.012), setup);
}

}  // namespace firn::test::pilot
