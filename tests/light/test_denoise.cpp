// SPDX-License-Identifier: MIT
// The denoiser: less noise than four times the samples have, and no other picture.
#include <cmath>

#include "tests/catch.h"
#include "tests/light/scenes.h"

namespace firn::test::denoise {
namespace {

// Of what does not glint: sparkle is no noise, and is left as it is.
double rmse(const Picture& a, const Picture& b) {
  const std::vector<float>&glints_a = a.layers[0].values, &glints_b = b.layers[0].values;
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i)
    sum += std::pow((a.rgb[i] - glints_a[i]) - (b.rgb[i] - glints_b[i]), 2);
  return std::sqrt(sum / static_cast<double>(a.rgb.size()));
}

}  // namespace

TEST_CASE("the denoiser at 16 samples beats 64 samples, and keeps the light", "[slow]") {
  constexpr int kSeeds = 2;
  for (auto& [name, setup, snapshot] : small_scenes(96)) {
    setup.layers = {Layer::sparkle};
    setup.image.samples = 1024;
    setup.seed = 100;
    const Picture truth = render(snapshot, setup);
    double four = 0, denoised = 0, bias = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      setup.seed = static_cast<std::uint64_t>(seed);
      setup.image.samples = 64;
      setup.denoise = false;
      four += rmse(render(snapshot, setup), truth);
      setup.image.samples = 16;
      const Picture plain = render(snapshot, setup);
      setup.denoise = true;
      const Picture smooth = render(snapshot, setup);
      denoised += rmse(smooth, truth);
      bias += luminance_of(mean(smooth)) / luminance_of(mean(plain)) - 1;
    }
    INFO(name << ": error " << denoised / kSeeds << ", of 64 samples " << four / kSeeds << ", bias "
              << bias / kSeeds);
    CHECK(denoised <= four);
    CHECK(std::fabs(bias / kSeeds) < 0.005);
  }
}

TEST_CASE("the denoiser keeps the light of glinting snow and leaves its sparkle alone") {
  auto [name, setup, snapshot] = small_scenes(96).back();
  REQUIRE(name == "glinting snow");
  setup.layers = {Layer::sparkle};
  double bias = 0, glints = 0;
  constexpr int kSeeds = 4;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    setup.seed = static_cast<std::uint64_t>(seed);
    setup.denoise = false;
    const Picture plain = render(snapshot, setup);
    setup.denoise = true;
    const Picture smooth = render(snapshot, setup);
    CHECK(smooth.layers[0].values == plain.layers[0].values);
    for (const float value : plain.layers[0].values) glints += value > 0;
    bias += luminance_of(mean(smooth)) / luminance_of(mean(plain)) - 1;
  }
  CHECK(glints > 100);
  CHECK(std::fabs(bias / kSeeds) < 0.005);
}

}  // namespace firn::test::denoise
