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
#include "tests/points.h"

namespace firn::test::snow_albedo {
namespace {

// Two particles a cell of the render grid across: the surface is plane then. On a cubic lattice it has bumps
// of 0.14 mm every 32 mm, and of light that goes much farther the crests lose 5 % less than the mean.
constexpr double kSpacing = 0.01, kCell = 1.6 * kSpacing;  // m; that of the particles' volume
constexpr double kAside = kCell / 2, kBelow = kSpacing * kSpacing * kSpacing / (kAside * kAside);  // m
constexpr int kAcross = 96, kDeep = 13;
constexpr double kDensity = 300;  // kg/m^3
// Absorption is per collision, so how far apart these are is free: 300 mean free paths in a cell.
constexpr double kExtinction = 300 / kCell / kDensity;              // m^2/kg
constexpr double kDepth = kExtinction * kDensity * kBelow * kDeep;  // mean free paths: 3809

// Its upper side about height 0.
Snapshot bed() {
  Points points(2 * kSpacing);
  for (int i = 0; i < kAcross * kDeep * kAcross; ++i) {
    const double x = kAside * (i % kAcross - kAcross / 2 + 0.5), y = kBelow * (-i / kAcross % kDeep - 0.5),
                 z = kAside * (i / kAcross / kDeep - kAcross / 2 + 0.5);
    points.add(Vec3(x, y, z), std::pow(kSpacing, 3));
  }
  return points.snapshot(kDensity);
}

// In light from all around.
RenderSetup bed_setup(bool reference, IceSource ice, double grain) {
  RenderSetup setup = empty_setup(Vec3(0, 1, 0), Vec3::Zero(), 1, 1, 1, 100000000);
  setup.image.snow_light = SnowLight::inside;
  setup.image.reference = reference;
  setup.image.ice = ice;
  setup.snow[0].density = kDensity;
  setup.snow[0].extinction = kExtinction;
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

// Of a bed that is not without end and lit on both its sides: nothing flows through its middle, so by
// diffusion the light that is lost is less by tanh of half its depth in e-foldings.
double reflectance_of_bed(const DeepSnow& deep, double coalbedo) {
  const double folding = std::sqrt(3 * coalbedo * (1 - kNaturalAnisotropy));  // per mean free path
  return 1 - (1 - deep(coalbedo)) * std::tanh(0.5 * folding * kDepth);
}

}  // namespace

TEST_CASE("a bed of particles reflects the colour that adding-doubling says, by grain",
          "[light][figure][slow]") {
  struct Look {
    bool reference;
    double mu;
    IceSource ice;
    double grain;  // m; 0: white
  };
  // Without absorption the same paths bring 1 in the mean, and most of their noise.
  std::vector<Look> looks;
  for (const bool reference : {true, false}) {
    for (const double mu : {1.0, 0.5}) {
      for (const double grain : {0.0, 101.93e-6, 509.64e-6, 1019.29e-6})
        looks.push_back({reference, mu, IceSource::picard, grain});
      // Of finer grains light would go too deep.
      looks.push_back({reference, mu, IceSource::warren_brandt, 1019.29e-6});
    }
  }
  const Snapshot snow = bed();
  const auto pictures = side_by_side(looks.size(), [&](std::size_t k) {
    const auto& [reference, mu, ice, grain] = looks[k];
    const int samples = (reference ? 8 : 64) * (makes_figures() ? 3 : 1);
    const Vec3 from(std::sqrt(1 - mu * mu), mu, 0);
    return picture_along(bed_setup(reference, ice, grain), snow, from, Vec3::Zero(), 16, samples);
  });
  Curve curve("light_bed", "series,grain_um,expected,measured,error"),
      similar("light_similar_bed", "series,grain_um,expected,measured,error");
  Scores scores;
  const Picture* white = nullptr;
  for (std::size_t k = 0; k < looks.size(); ++k) {
    const auto& [reference, mu, ice, grain] = looks[k];
    if (grain == 0) {
      white = &pictures[k];
      continue;
    }
    Picture lost = pictures[k];
    for (std::size_t i = 0; i < lost.rgb.size(); ++i) lost.rgb[i] = white->rgb[i] - lost.rgb[i];
    const DeepSnow deep(mu == 1 ? "R_mu0_1" : "R_mu0_05");
    const Vec3 expected = color_of(ice, [&, ice_way = ice_per_collision(grain)](double absorption) {
      return reflectance_of_bed(deep, -std::expm1(-absorption * ice_way));
    });
    for (std::size_t c = 0; c < 3; ++c) {
      const Estimate dark = channel_of(lost, c);
      const double seen = 1 - dark.mean, should = expected[static_cast<Eigen::Index>(c)];
      const std::string series = std::string("RGB").substr(c, 1) +
                                 (ice == IceSource::picard ? " P16" : " WB08") + (mu == 1 ? " 1" : " 0.5");
      INFO(series << ", grain " << grain << ", reference " << reference << ": " << seen << " +- "
                  << dark.error << ", expected " << should);
      // What similarity makes of it: measured to be 1.3e-3.
      CHECK(std::fabs(seen - should) < std::max(1e-3, 3.5 * dark.error) + (reference ? 0 : 2e-3));
      CHECK(dark.error < (reference ? 6e-3 : 3e-3));
      if (reference) scores.add(seen, should, dark.error);
      (reference ? curve : similar).add(series, {1e6 * grain, should, seen, dark.error});
    }
  }
  // Grains and channels share their paths, so the scores go together.
  CHECK(scores.largest() < 4.5);
}

}  // namespace firn::test::snow_albedo
