// SPDX-License-Identifier: MIT
// The colour of snow: measured absorption of ice, what of it a collision meets, and what eyes make of it.
#include <cmath>

#include "src/core/rng.h"
#include "src/render/snow/ice.h"
#include "tests/catch.h"
#include "tests/light/reference_table.h"

namespace firn::test::ice {
using test::reference_table;

namespace {

IceSource source(const std::string& name) {
  return name == "P16" ? IceSource::picard : IceSource::warren_brandt;
}

// Decay of light in deep snow, 1/m, by diffusion.
double decay(IceSource data, double nm, double density, double grain, double enhancement, double anisotropy) {
  const double coalbedo = 1 - std::exp(-ice_absorption(data, nm) * ice_per_collision(grain, enhancement));
  return snow_extinction(grain) * density * std::sqrt(3 * coalbedo * (1 - anisotropy));
}

// CIE 1931 2-degree colour matching functions and D65 as tabulated (CIE 15:2004), 400 to 700 nm by 10.
constexpr double kMatching[3][31] = {
    {0.0143, 0.0435, 0.1344, 0.2839, 0.3483, 0.3362, 0.2908, 0.1954, 0.0956, 0.0320, 0.0049,
     0.0093, 0.0633, 0.1655, 0.2904, 0.4334, 0.5945, 0.7621, 0.9163, 1.0263, 1.0622, 1.0026,
     0.8544, 0.6424, 0.4479, 0.2835, 0.1649, 0.0874, 0.0468, 0.0227, 0.0114},
    {0.0004, 0.0012, 0.0040, 0.0116, 0.0230, 0.0380, 0.0600, 0.0910, 0.1390, 0.2080, 0.3230,
     0.5030, 0.7100, 0.8620, 0.9540, 0.9950, 0.9950, 0.9520, 0.8700, 0.7570, 0.6310, 0.5030,
     0.3810, 0.2650, 0.1750, 0.1070, 0.0610, 0.0320, 0.0170, 0.0082, 0.0041},
    {0.0679, 0.2074, 0.6456, 1.3856, 1.7471, 1.7721, 1.6692, 1.2876, 0.8130, 0.4652, 0.2720,
     0.1582, 0.0782, 0.0422, 0.0203, 0.0087, 0.0039, 0.0021, 0.0017, 0.0011, 0.0008, 0.0003,
     0.0002, 0,      0,      0,      0,      0,      0,      0,      0}};
constexpr double kDaylight[31] = {82.7549, 91.486,  93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861,
                                  115.923, 108.811, 109.354, 107.802, 104.79,  107.689, 104.405, 104.046,
                                  100,     96.3342, 95.788,  88.6856, 90.0062, 89.5991, 87.6987, 83.2886,
                                  83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091};

// Linear sRGB of daylight of which each wavelength keeps `kept(absorption)`.
template <class Kept>
Vec3 tabulated_color(IceSource data, Kept kept) {
  Mat3 to_rgb;
  to_rgb << 3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570;
  Vec3 sum = Vec3::Zero(), white = Vec3::Zero();
  for (int i = 0; i < 31; ++i) {
    const Vec3 rgb = to_rgb * Vec3(kMatching[0][i], kMatching[1][i], kMatching[2][i]) * kDaylight[i];
    sum += kept(ice_absorption(data, 400 + 10 * i)) * rgb;
    white += rgb;
  }
  return sum.cwiseQuotient(white);
}

}  // namespace

TEST_CASE("ice absorbs as measured, seven times more at 450 nm by one source than by the other", "[light]") {
  for (auto& row : reference_table("ice_nk_400_700")) {
    const double nm = std::stod(row["lambda_nm"]);
    CHECK(ice_absorption(IceSource::picard, nm) == Approx(std::stod(row["abs_P16_per_m"])).epsilon(1e-3));
    CHECK(ice_absorption(IceSource::warren_brandt, nm) ==
          Approx(std::stod(row["abs_WB08_per_m"])).epsilon(1e-3));
  }
  CHECK(ice_absorption(IceSource::picard, 450) / ice_absorption(IceSource::warren_brandt, 450) ==
        Approx(6.94).epsilon(1e-2));
  CHECK(ice_absorption(IceSource::picard, 455) == Approx(0.018475).epsilon(1e-3));  // half way
  CHECK(ice_absorption(IceSource::picard, 300) == ice_absorption(IceSource::picard, 400));
  CHECK(ice_absorption(IceSource::picard, 900) == ice_absorption(IceSource::picard, 700));
}

TEST_CASE("a collision absorbs what Mie's sums say for spheres, and 1.6 / 1.3 of it for natural grains",
          "[light]") {
  for (auto& row : reference_table("snow_albedo_semiinf")) {
    const bool spheres = row["model"] == "mie_sphere";
    const double grain = 1e-6 * std::stod(row["reff_um"]);
    const double ice = ice_per_collision(grain, spheres ? kSphereEnhancement : kNaturalEnhancement);
    const double coalbedo =
        1 - std::exp(-ice_absorption(source(row["k_source"]), std::stod(row["lambda_nm"])) * ice);
    // Mie's B lies between 1.293 and 1.311; the natural one is exact but for the five digits of the table.
    CHECK(coalbedo == Approx(std::stod(row["coalbedo"])).epsilon(spheres ? 1e-2 : 3e-4));
  }
}

TEST_CASE("light decays in deep snow as by adding-doubling", "[light]") {
  for (auto& row : reference_table("snow_albedo_semiinf")) {
    const double grain = 1e-6 * std::stod(row["reff_um"]), nm = std::stod(row["lambda_nm"]);
    const bool spheres = row["model"] == "mie_sphere";
    const double anisotropy = std::stod(row["g"]);
    const double per_depth = decay(source(row["k_source"]), nm, 1, grain,
                                   spheres ? kSphereEnhancement : kNaturalEnhancement, anisotropy) /
                             snow_extinction(grain);
    CHECK(per_depth == Approx(std::stod(row["afec_per_tau"])).epsilon(spheres ? 5e-3 : 1e-3));
  }
  // Density 300 kg/m^3, median radius 0.5 mm, spheres: 64, 36 and 16.6 cm by Picard, 169, 38 and 16.6 cm by
  // Warren and Brandt, so through 10 cm of it come 0.547, 0.755 and 0.856 of red, green and blue by Picard.
  const auto depth = [](IceSource data, double nm) {
    return 1 / decay(data, nm, 300, 509.64e-6, kSphereEnhancement, kSphereAnisotropy);
  };
  CHECK(depth(IceSource::picard, 450) == Approx(0.64).margin(0.01));
  CHECK(depth(IceSource::warren_brandt, 450) == Approx(1.69).margin(0.02));
  CHECK(depth(IceSource::warren_brandt, 550) == Approx(0.38).margin(0.01));
  CHECK(depth(IceSource::picard, 650) == Approx(0.166).margin(0.003));
  CHECK(std::exp(-0.1 / depth(IceSource::picard, 650)) == Approx(0.547).margin(0.007));
  CHECK(std::exp(-0.1 / depth(IceSource::picard, 550)) == Approx(0.755).margin(0.005));
  CHECK(std::exp(-0.1 / depth(IceSource::picard, 450)) == Approx(0.856).margin(0.003));
}

TEST_CASE("the tint of ice is white at first and then what the tabulated eye sees", "[light]") {
  for (const IceSource data : {IceSource::picard, IceSource::warren_brandt}) {
    const IceTint tint(data);
    CHECK(tint(0) == Vec3f::Ones());
    CHECK(tint(-1) == Vec3f::Ones());
    CHECK(tint(1e6f).norm() < 1e-5f);
    double worst = 0;
    for (double way = 1e-3; way < 300; way *= 1.3) {
      const Vec3 seen = tabulated_color(data, [way](double a) { return std::exp(-a * way); });
      worst = std::max(worst, (tint(static_cast<float>(way)).cast<double>() - seen).cwiseAbs().maxCoeff());
    }
    CHECK(worst < 0.02);  // the error of the fit to the colour matching functions
  }
}

TEST_CASE("the table of tints is as good as the sum over wavelengths", "[light]") {
  for (const IceSource data : {IceSource::picard, IceSource::warren_brandt}) {
    const IceTint tint(data);
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
      const auto way = static_cast<float>(std::exp(16 * uniform_double(hash_keys(3, i)) - 8));
      worst = std::max(worst, (tint(way).cast<double>() - ice_color(data, way)).cwiseAbs().maxCoeff());
    }
    CHECK(worst < 5e-5);
    CHECK(worst > 1e-7);  // it is a table
  }
}

// Ways of light that diffuses through a depth of snow are spread as a Levy density, whose mean of exp(-a way)
// is exp(-s sqrt(a)): tints of single paths must average to the tint of the whole.
TEST_CASE("tints of the paths through 10 cm of snow average to the decay by wavelength", "[light]") {
  const double grain = 0.5e-3;
  const double s =
      0.1 * snow_extinction(grain) * 300 * std::sqrt(3 * ice_per_collision(grain) * (1 - kNaturalAnisotropy));
  for (const IceSource data : {IceSource::picard, IceSource::warren_brandt}) {
    const IceTint tint(data);
    const int steps = 100000;
    Vec3 mean = Vec3::Zero();
    double weights = 0;
    for (int i = 0; i < steps; ++i) {
      const double x = 8 * (i + 0.5) / steps, weight = std::exp(-0.5 * x * x);
      mean += weight * tint(static_cast<float>(s * s / (2 * x * x))).cast<double>();
      weights += weight;
    }
    mean /= weights;
    const Vec3 whole = tabulated_color(data, [s](double a) { return std::exp(-s * std::sqrt(a)); });
    INFO("mean " << mean.transpose() << ", whole " << whole.transpose());
    CHECK((mean - whole).cwiseAbs().maxCoeff() < 0.01);
    CHECK(mean[2] > mean[1]);
    CHECK(mean[1] > mean[0]);
  }
}

}  // namespace firn::test::ice
