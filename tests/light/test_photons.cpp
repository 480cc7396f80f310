// SPDX-License-Identifier: MIT
// Photons that walk through media: how far, how often they collide, how much of them comes back from deep
// snow and how they fade in it, by wavelength.
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "src/core/rng.h"
#include "src/render/sampling/directions.h"
#include "src/render/sampling/phase.h"
#include "src/render/snow/ice.h"
#include "src/render/solids/media.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/light/estimate.h"
#include "tests/light/photons.h"
#include "tests/light/reference_table.h"

namespace firn::test::photons {
namespace {

using Row = std::map<std::string, std::string>;

double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

// The length of a walk through a ball of radius 1 of light that enters from all sides alike.
double way_through_ball(const MediumSet& media, float g, Draws draws) {
  Vec3f p(0, 0, 1), d = cosine_direction(Vec3f(0, 0, -1), draws.pair());
  double length = 0;
  for (;;) {
    const auto flight = media.fly(p, d, INFINITY, draws.key());
    if (flight.medium < 0) {
      const double along = p.cast<double>().dot(d.cast<double>());
      return length - along + std::sqrt(std::max(along * along - p.cast<double>().squaredNorm() + 1, 0.0));
    }
    length += flight.t;
    p += flight.t * d;
    d = phase_direction(g, d, draws.pair());
  }
}

Vec3f incident(const std::string& incidence, Draws& draws) {
  if (incidence == "R_mu0_05") return {std::sqrt(0.75f), -0.5f, 0};
  return incidence == "R_diffuse" ? cosine_direction(Vec3f(0, -1, 0), draws.pair()) : Vec3f(0, -1, 0);
}

// What deep snow of mean cosine g keeps of light of several wavelengths, which lose 1 - exp(n log_albedo) by
// a walk of n collisions. From `patience` collisions on a walk goes on by chance: whenever its length has
// grown fourfold, half of them do, and count twice from there on. Where nothing is left of any wavelength it
// ends.
std::vector<Estimate> lost_in_snow(double g, const Eigen::ArrayXd& log_albedo, const std::string& incidence,
                                   std::uint64_t photons, double patience) {
  constexpr double kNothing = -14;  // of the logarithm: below 1e-6
  const Medium snow = slab(1, g, INFINITY);
  MediumSet media({snow});
  media.place(Vec3::Zero());
  const double most = kNothing / log_albedo.maxCoeff();
  const auto walk = [&](std::uint64_t photon) {
    Draws draws(hash_keys(6, photon, key_of(g), incidence.size()));
    Vec3f p = Vec3f::Zero(), d = incident(incidence, draws);
    Eigen::ArrayXd left = Eigen::ArrayXd::Ones(log_albedo.size()), lost = 0 * left;
    double weight = 1, collisions = 0;
    const auto lose = [&] {
      const Eigen::ArrayXd now = (collisions * log_albedo).exp();
      lost += weight * (left - now);
      left = now;
    };
    for (double next = patience; collisions < most;) {
      const auto flight = media.fly(p, d, INFINITY, draws.key());
      if (flight.medium < 0) break;
      p.y() += flight.t * d.y();  // depth alone matters
      d = phase_direction(snow.g, d, draws.pair());
      if (++collisions < next) continue;
      lose();
      if (draws.pair().u < 0.5f) return lost;
      weight *= 2, next *= 4;
    }
    lose();
    return lost;
  };
  return means_of(photons, log_albedo.size(), walk);
}

// Rows of one kind of snow that walk alike, against the table. error: to be reached; half of what is lost is
// the spread of a yes or no.
void check_albedo(std::vector<Row> rows, const std::vector<std::string>& incidences, double patience,
                  double error, Curve& curve, Scores& scores) {
  Eigen::ArrayXd log_albedo(static_cast<Eigen::Index>(rows.size()));
  double lost = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    log_albedo[static_cast<Eigen::Index>(k)] = std::log1p(-number(rows[k]["coalbedo"]));
    lost = std::max(lost, 1 - number(rows[k]["R_mu0_1"]));
  }
  const auto photons = static_cast<std::uint64_t>(0.5 * lost / (error * error));
  for (const std::string& incidence : incidences) {
    const std::vector<Estimate> lost =
        lost_in_snow(number(rows[0]["g"]), log_albedo, incidence, photons, patience);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      Row& row = rows[k];
      const double expected = number(row[incidence]), seen = 1 - lost[k].mean, error = lost[k].error;
      const std::string series = row["model"] + " " + row["k_source"] + " " + row["r0_um"] + " " + incidence;
      INFO(series << ", " << row["lambda_nm"] << " nm: " << seen << " +- " << error << ", expected "
                  << expected);
      CHECK(std::fabs(seen - expected) < std::max(1e-3, 3 * error));
      CHECK(error < 1e-3);
      scores.add(seen, expected, error);
      curve.add(series, {number(row["lambda_nm"]), expected, seen, error});
    }
  }
}

}  // namespace

TEST_CASE("light walks 4V/S through a convex body that scatters, whatever is in it", "[light][figure]") {
  // Light from all sides enters a ball evenly over its surface, cosine-distributed.
  Curve curve("light_way", "series,sigma,expected,measured,error");
  Scores scores;
  for (const double sigma : {0.5, 2.0, 5.0, 20.0}) {
    for (const double g : {0.0, 0.8}) {
      Medium medium;
      medium.shape.form = Ball{1};
      medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma));
      medium.g = static_cast<float>(g);
      MediumSet media({medium});
      media.place(Vec3::Zero());
      // Long walks weigh more the more there is to scatter.
      const std::uint64_t photons = (sigma > 10 ? 1 << 22 : 1 << 20) * (makes_figures() ? 2 : 1);
      const Estimate seen = mean_of(photons, [&](std::uint64_t photon) {
        return way_through_ball(media, medium.g, Draws(hash_keys(5, photon, key_of(sigma), key_of(g))));
      });
      INFO("sigma " << sigma << " g " << g << ": " << seen.mean << " +- " << seen.error);
      CHECK(seen.mean == Approx(4.0 / 3).epsilon(0.005));
      CHECK(seen.error < 0.0017 * 4 / 3);
      scores.add(seen.mean, 4.0 / 3, seen.error);
      curve.add("g = " + std::string(g > 0 ? "0.8" : "0"), {sigma, 4.0 / 3, seen.mean, seen.error});
    }
  }
  require_unbiased(scores);
}

TEST_CASE("deep snow reflects by wavelength and grain what adding-doubling says", "[light][figure][slow]") {
  // Walks with the true phase function, as the path tracer has it. Natural grains of all sizes walk alike.
  // Spheres scatter by their size; both sources of absorption share a walk.
  std::vector<Row> natural;
  std::map<std::string, std::vector<Row>> spheres;
  for (auto& row : reference_table("snow_albedo_semiinf")) {
    if (row["model"] == "mie_sphere") {
      spheres[row["lambda_nm"] + " " + row["r0_um"]].push_back(row);
    } else {
      natural.push_back(row);
    }
  }
  Curve curve("light_albedo", "series,nm,expected,measured,error");
  Scores scores;
  check_albedo(natural, {"R_mu0_1", "R_mu0_05", "R_diffuse"}, 1000, 7e-4, curve, scores);
  // Chance ends walks of which the more absorbing source has left little. For figures spheres of all sizes.
  for (auto& [name, rows] : spheres) {
    if (makes_figures() || rows[0]["r0_um"] == "500")
      check_albedo(rows, {"R_mu0_1"}, 2 / number(rows.back()["coalbedo"]), 7e-4, curve, scores);
  }
  // One set of walks has all wavelengths, so the scores go together.
  CHECK(scores.largest() < 4.5);
}

TEST_CASE("a photon collides (1 - R) / (1 - albedo) times in a half space", "[light][figure]") {
  // Analog: a photon survives a collision with the chance of the albedo. Absorbed ones are those that did not
  // leave, so collisions - absorbed / (1 - albedo) has the mean 0, photon by photon.
  Curve curve("light_collisions", "series,co_albedo,expected,measured,error");
  Scores scores;
  for (const double albedo : {0.5, 0.9, 0.99, 0.999}) {
    for (const double g : {0.0, 0.75}) {
      MediumSet media({slab(albedo, g, INFINITY)});
      media.place(Vec3::Zero());
      const auto walk = [&](std::uint64_t photon) -> Eigen::Array3d {
        Draws draws(hash_keys(77, photon, key_of(albedo), key_of(g)));
        Vec3f p = Vec3f::Zero(), d(0, -1, 0);
        for (double collisions = 0;;) {
          const auto flight = media.fly(p, d, INFINITY, draws.key());
          if (flight.medium < 0) return Eigen::Array3d(collisions, 0, collisions);
          ++collisions;
          if (uniform_double(draws.key()) >= albedo)
            return Eigen::Array3d(collisions, 1, collisions - 1 / (1 - albedo));
          p += flight.t * d;
          d = phase_direction(static_cast<float>(g), d, draws.pair());
        }
      };
      const std::vector<Estimate> seen = means_of((makes_figures() ? 4 : 1) << 17, 3, walk);
      const double expected = seen[1].mean / (1 - albedo);
      INFO("albedo " << albedo << ", g " << g << ": " << seen[0].mean << ", expected " << expected
                     << ", apart " << seen[2].mean << " +- " << seen[2].error);
      CHECK(std::fabs(seen[2].mean) < 3.5 * seen[2].error);
      scores.add(seen[2].mean, 0, seen[2].error);
      curve.add(g > 0 ? "g = 0.75" : "g = 0", {1 - albedo, expected, seen[0].mean, seen[2].error});
    }
  }
  require_unbiased(scores);
}

TEST_CASE("light fades in deep snow by the depths and to the tint of the tables", "[light][figure][slow]") {
  // Density 300 kg/m^3, spheres of median radius 0.5 mm: e-folding depths of 64, 36 and 16.6 cm, so that 10
  // cm deeper 0.856, 0.755 and 0.547 of blue, green and red are left. Collisions by depth, of light that
  // enters from all sides.
  constexpr int kBins = 24;             // of 1 cm
  constexpr double kGrain = 509.64e-6;  // m
  constexpr double kNanometers[3] = {450, 550, 650}, kFolding[3] = {0.64, 0.36, 0.166},
                   kLeft[3] = {0.856, 0.755, 0.547};
  const double per_cm = snow_extinction(kGrain) * 300 * 0.01;  // mean free paths
  Eigen::Array3d albedo, folding;
  for (int c = 0; c < 3; ++c) {
    const double coalbedo = -std::expm1(-ice_absorption(IceSource::picard, kNanometers[c]) *
                                        ice_per_collision(kGrain, kSphereEnhancement));
    albedo[c] = 1 - coalbedo;
    folding[c] = 0.01 / per_cm / std::sqrt(3 * coalbedo * (1 - kSphereAnisotropy));
    CHECK(folding[c] == Approx(kFolding[c]).epsilon(0.02));
  }
  const Medium snow = slab(1, kSphereAnisotropy, INFINITY);
  MediumSet media({snow});
  media.place(Vec3::Zero());
  const auto walk = [&](std::uint64_t photon) {
    Draws draws(photon);
    Vec3f p = Vec3f::Zero(), d = incident("R_diffuse", draws);
    Eigen::ArrayXd light = Eigen::ArrayXd::Zero(3 * kBins);
    Eigen::Array3d left = Eigen::Array3d::Ones();
    double collisions = 0;
    for (double next = 16000;;) {
      const auto flight = media.fly(p, d, INFINITY, draws.key());
      if (flight.medium < 0) return light;
      p.y() += flight.t * d.y();
      d = phase_direction(snow.g, d, draws.pair());
      const int bin = static_cast<int>(-p.y() / per_cm);
      if (bin < kBins) light.segment<3>(3 * bin) += left;
      left *= albedo;
      if (++collisions < next) continue;
      if (draws.pair().u < 0.5f) return light;
      left *= 2, next *= 4;
    }
  };
  // Shares of batches, since the depths of one walk go together.
  constexpr int kBatches = 32;
  const std::uint64_t photons = (makes_figures() ? 2 : 1) << 11;
  Eigen::ArrayXXd light(kBatches, 3 * kBins);
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto seen =
        means_of(photons, 3 * kBins, [&](std::uint64_t photon) { return walk(hash_keys(8, batch, photon)); });
    for (int k = 0; k < 3 * kBins; ++k) light(batch, k) = seen[static_cast<std::size_t>(k)].mean;
  }
  Curve curve("light_depth", "series,depth_cm,expected,measured,error");
  // At 5 to 10 cm and 10 cm below.
  const auto between = [&](int c, int from, int to) {
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(kBatches);
    for (int bin = from; bin < to; ++bin) sum += light.col(3 * bin + c);
    return sum;
  };
  for (int c = 0; c < 3; ++c) {
    const Eigen::ArrayXd share = between(c, 15, 20) / between(c, 5, 10).mean();
    const Eigen::ArrayXd apart = between(c, 15, 20) - share.mean() * between(c, 5, 10);
    const double error =
        std::sqrt(apart.square().sum() / (kBatches * (kBatches - 1))) / between(c, 5, 10).mean();
    const double expected = std::exp(-0.1 / folding[c]);
    INFO(kNanometers[c] << " nm: " << share.mean() << " +- " << error << " left, expected " << expected);
    CHECK(std::fabs(share.mean() - expected) < 3.5 * error);
    CHECK(error < 0.02);
    CHECK(expected == Approx(kLeft[c]).epsilon(0.01));
    const double scale = between(c, 5, 10).mean() / 5 * std::exp(0.075 / folding[c]);
    for (int bin = 0; bin < kBins; ++bin) {
      const Eigen::ArrayXd at = light.col(3 * bin + c) / scale;
      const double spread = std::sqrt((at - at.mean()).square().sum() / (kBatches * (kBatches - 1)));
      curve.add(std::to_string(static_cast<int>(kNanometers[c])) + " nm",
                {bin + 0.5, std::exp(-0.01 * (bin + 0.5) / folding[c]), at.mean(), spread});
    }
  }
}

}  // namespace firn::test::photons
