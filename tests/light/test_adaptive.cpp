// SPDX-License-Identifier: MIT
// Pixels that stop when they look good enough stop by what they have seen: those that missed bright paths
// look good. How much darker that makes a picture.
#include <cmath>

#include "tests/catch.h"
#include "tests/light/estimate.h"
#include "tests/light/scenes.h"

using namespace firn;
using namespace firn::test;

TEST_CASE("pictures that stop at a noise are as bright as those that take all samples", "[light]") {
  constexpr int kSeeds = 8;
  struct Seen {
    double apart = 0, samples = 0;
  };
  for (auto& [name, scene, snapshot] : small_scenes(32)) {
    const auto pictures = side_by_side(kSeeds, [&, &scene = scene, &snapshot = snapshot](std::size_t seed) {
      RenderSetup setup = scene;
      setup.image.samples = 256;
      setup.seed = 500 + seed;
      setup.image.noise = 0;
      setup.layers = {};
      const double full = luminance_of(mean(render(snapshot, setup)));
      setup.image.noise = 0.05;
      setup.layers = {Layer::samples};
      const Picture adaptive = render(snapshot, setup);
      Seen seen{luminance_of(mean(adaptive)) / full - 1, 0};
      for (const float count : adaptive.layers[0].values) seen.samples += count / (32. * 32);
      return seen;
    });
    double sum = 0, squares = 0, samples = 0;
    for (const Seen& seen : pictures) {
      sum += seen.apart;
      squares += seen.apart * seen.apart;
      samples += seen.samples / kSeeds;
    }
    const double bias = sum / kSeeds, error = std::sqrt((squares / kSeeds - bias * bias) / (kSeeds - 1));
    INFO(name << ": " << bias << " +- " << error << " with " << samples << " samples a pixel");
    CHECK(samples < 200);
    CHECK(std::fabs(bias) + 2 * error < 0.01);
  }
}

// Independent samples: those of a sequence spread less than their variance says.
TEST_CASE("the layer of the variance tells how far pictures of other seeds lie apart, splats included") {
  constexpr int kSeeds = 24;
  auto [name, setup, snapshot] = small_scenes(24)[1];
  setup.image.sampler = SamplerKind::independent;
  setup.layers = {Layer::variance};
  for (const Integrator integrator : {Integrator::path, Integrator::bidirectional, Integrator::light}) {
    setup.image.integrator = integrator;
    std::vector<double> sum(24 * 24), squares(24 * 24);
    double told = 0, spread = 0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      setup.seed = static_cast<std::uint64_t>(seed);
      const Picture picture = render(snapshot, setup);
      for (std::size_t k = 0; k < sum.size(); ++k) {
        const double value =
            luminance_of(Vec3f(picture.rgb[3 * k], picture.rgb[3 * k + 1], picture.rgb[3 * k + 2]));
        sum[k] += value, squares[k] += value * value;
        told += picture.layers[0].values[k];
      }
    }
    for (std::size_t k = 0; k < sum.size(); ++k)
      spread += (squares[k] - sum[k] * sum[k] / kSeeds) / (kSeeds - 1);
    INFO(name << " by " << name_of(integrator) << ": told " << told / kSeeds << ", spread " << spread);
    CHECK(told / kSeeds == Approx(spread).epsilon(0.1));
  }
}
