// SPDX-License-Identifier: MIT
// A bed of snow of particles, through surface, density and delta tracking as any scene has them, against deep
// snow by adding-doubling: what it reflects by grain and by absorption of ice, in colour.
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "src/render/snow/ice.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/light/estimate.h"
#include "tests/light/reference_table.h"

using namespace firn;
using namespace firn::test;

namespace {

constexpr double kSpacing = 0.01;  // m
constexpr double kDensity = 300;   // kg/m^3

// 48 x 20 x 48 particles, its upper side about height 0.
Snapshot bed() {
  constexpr int kAcross = 48, kDeep = 20;
  Snapshot snow;
  snow.dx = 2 * kSpacing;
  for (int i = 0; i < kAcross * kDeep * kAcross; ++i) {
    const Vec3 at(i % kAcross - kAcross / 2, -i / kAcross % kDeep, i / kAcross / kDeep - kAcross / 2);
    for (int a = 0; a < 3; ++a) snow.x[a].push_back(static_cast<float>(kSpacing * (at[a] + 0.5)));
    snow.density.push_back(kDensity);
    snow.volume0.push_back(static_cast<float>(std::pow(kSpacing, 3)));
    snow.id.push_back(static_cast<std::uint32_t>(i));
  }
  snow.resize(snow.density.size());
  return snow;
}

// In light from all around. Absorption is per collision, so how far apart these are is free: 300 mean
// free paths in a cell, so that the bed is 3750 deep, three times what even most blue fades over.
RenderSetup bed_setup(IceSource ice, double grain) {
  RenderSetup setup = empty_setup(Vec3(0, 1, 0), Vec3::Zero(), 1, 1, 1, 100000000);
  setup.image.snow_light = SnowLight::inside;
  setup.image.reference = true;
  setup.image.ice = ice;
  setup.snow[0].density = kDensity;
  setup.snow[0].extinction = 300 / (1.6 * kSpacing) / kDensity;
  setup.snow[0].ice_per_collision = ice_per_collision(grain);
  setup.lights.push_back(ConstantLight{Vec3f::Ones()});
  return setup;
}

// Reflectance of deep snow of natural grains by co-albedo: the rows of all wavelengths and grains lie on one
// curve, near to exp(-k sqrt(co-albedo)), and k is linear between them.
class DeepSnow {
 public:
  explicit DeepSnow(const std::string& incidence) {
    for (auto& row : reference_table("snow_albedo_semiinf")) {
      if (row["model"] == "mie_sphere") continue;
      const double root = std::sqrt(std::strtod(row["coalbedo"].c_str(), nullptr));
      slope_[root] = -std::log(std::strtod(row[incidence].c_str(), nullptr)) / root;
    }
  }
  double operator()(double coalbedo) const {
    const double root = std::sqrt(coalbedo);
    const auto above = slope_.lower_bound(root);
    if (above == slope_.begin()) return std::exp(-root * above->second);
    if (above == slope_.end()) return std::exp(-root * slope_.rbegin()->second);
    const auto below = std::prev(above);
    const double part = (root - below->first) / (above->first - below->first);
    return std::exp(-root * (below->second + part * (above->second - below->second)));
  }

 private:
  std::map<double, double> slope_;  // by the root of the co-albedo
};

}  // namespace

TEST_CASE("a bed of particles reflects the colour that adding-doubling says, by grain", "[light][figure]") {
  const Snapshot snow = bed();
  struct Grains {
    IceSource ice;
    std::vector<double> radii;  // m
  };
  // By Warren and Brandt fine grains would need a deeper bed.
  const std::vector<Grains> kinds{{IceSource::picard, {101.93e-6, 509.64e-6, 1019.29e-6}},
                                  {IceSource::warren_brandt, {1019.29e-6}}};
  Curve curve("light_bed", "series,grain_um,expected,measured,error");
  Scores scores;
  for (const double mu : {1.0, 0.5}) {
    const DeepSnow deep(mu == 1 ? "R_mu0_1" : "R_mu0_05");
    const auto look = [&](const RenderSetup& setup) {
      const Vec3 from(std::sqrt(1 - mu * mu), mu, 0);
      return picture_along(setup, snow, from, Vec3::Zero(), 16, makes_figures() ? 24 : 8);
    };
    // Without absorption the same paths bring 1 in the mean, and most of their noise.
    const Picture white = look(bed_setup(IceSource::picard, 0));
    for (const auto& [ice, radii] : kinds) {
      for (const double grain : radii) {
        const RenderSetup setup = bed_setup(ice, grain);
        Picture lost = look(setup);
        for (std::size_t k = 0; k < lost.rgb.size(); ++k) lost.rgb[k] = white.rgb[k] - lost.rgb[k];
        const Vec3 expected =
            color_of(ice, [&, ice_way = setup.snow[0].ice_per_collision](double absorption) {
              return deep(-std::expm1(-absorption * ice_way));
            });
        for (std::size_t c = 0; c < 3; ++c) {
          const Estimate dark = channel_of(lost, c);
          const double seen = 1 - dark.mean, should = expected[static_cast<Eigen::Index>(c)];
          const std::string series = std::string("RGB").substr(c, 1) +
                                     (ice == IceSource::picard ? " P16" : " WB08") +
                                     (mu == 1 ? " 1" : " 0.5");
          INFO(series << ", grain " << grain << ": " << seen << " +- " << dark.error << ", expected "
                      << should);
          CHECK(std::fabs(seen - should) < std::max(1e-3, 3.5 * dark.error));
          CHECK(dark.error < 6e-3);
          scores.add(seen, should, dark.error);
          curve.add(series, {1e6 * grain, should, seen, dark.error});
        }
      }
    }
  }
  // Grains and channels share their paths, so the scores go together.
  CHECK(scores.largest() < 4.5);
}
