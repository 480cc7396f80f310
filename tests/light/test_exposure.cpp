// SPDX-License-Identifier: MIT
// How a frame is put together: moments of an open shutter, and pixels that stop when they are good enough.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/catch.h"
#include "tests/light/pictures.h"

namespace firn::test::exposure {
namespace {

// A snowball that flies to the right and a dark ball that key frames lead upwards.
RenderSetup moving_setup() {
  RenderSetup setup = empty_setup(Vec3(0, 0, 2), Vec3::Zero(), 30, 40, 64, 0);
  const int dark = add_surface(setup, SurfaceKind::diffuse, 0.2f);
  Shape ball;
  ball.form = Ball{0.1};
  ball.pose.translation = Vec3(0.3, 0, 0);
  add_object(setup, ball, dark);
  setup.objects.back().motion = Motion({{0, Vec3(0, -0.3, 0)}, {1, Vec3(0, 0.3, 0)}}, Vec3::Zero());
  setup.lights.push_back(ConstantLight{Vec3f::Ones()});
  setup.layers = {Layer::albedo};
  setup.frame_seconds = 0.5;
  return setup;
}

Snapshot flying(double time) {
  const Vec3 velocity(0.4, 0, 0);
  Snapshot snow = snowball(Vec3(-0.25, 0, 0) + velocity * (time - 0.5), 0.1, 0.02);
  snow.time = time;
  for (float& v : snow.velocity[0]) v = static_cast<float>(velocity.x());
  return snow;
}

double distance(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] - b[i], 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace

// What is met first is noise-free but for the edges, so its layer shows the blur: the mean of pictures at the
// four moments, in the middles of the quarters of the time that the shutter is open.
TEST_CASE("an open shutter sees the mean of its moments, of snow, objects and camera") {
  RenderSetup setup = moving_setup();
  setup.camera.motion = {{0, Vec3(0, 0, 2), Vec3::Zero()}, {1, Vec3(0, 0, 1.8), Vec3::Zero()}};
  const std::vector<float> still = render(flying(0.5), setup).layers[0].values;
  std::vector<float> mean(still.size(), 0.f);
  for (const double part : {0.125, 0.375, 0.625, 0.875}) {
    const auto one = render(flying(0.5 + 0.8 * 0.5 * (part - 0.5)), setup).layers[0].values;
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += one[i] / 4;
  }
  setup.camera.shutter = 0.8;
  const std::vector<float> blurred = render(flying(0.5), setup).layers[0].values;
  INFO("to the mean " << distance(blurred, mean) << ", to the still picture " << distance(blurred, still));
  CHECK(distance(blurred, mean) < 0.2 * distance(blurred, still));
}

// The picture is half smooth sky, which is done after 16 samples, and half a noisy scene.
TEST_CASE("adaptive samples go where the noise is, and the picture has the same bits for any threads") {
  RenderSetup setup = moving_setup();
  setup.lights.push_back(SunLight{Vec3(-1, 0.5, 0.6), 20, Vec3f(3, 2.7f, 2.4f)});
  setup.image.max_bounces = 3;
  setup.image.samples = 256;
  setup.image.noise = 0.03;
  setup.layers = {Layer::samples};
  const Picture adaptive = render(flying(0.5), setup);
  const std::vector<float>& samples = adaptive.layers[0].values;
  CHECK(samples[0] == 16);
  CHECK(*std::max_element(samples.begin(), samples.end()) > 16);
  for (const float count : samples)
    REQUIRE((count >= 16 && count <= 256 && std::fmod(std::log2(count), 1) == 0));
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    CHECK(hash(render(flying(0.5), setup)) == hash(adaptive));
  }
  setup.image.noise = 0;
  const Picture full = render(flying(0.5), setup);
  CHECK(luminance_of(mean(adaptive)) == Approx(luminance_of(mean(full))).epsilon(0.01));
}

}  // namespace firn::test::exposure
