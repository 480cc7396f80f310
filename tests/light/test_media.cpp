// SPDX-License-Identifier: MIT
// Homogeneous media against transport theory. By reciprocity the part of a beam that a slab reflects is the
// radiance that it shows in the beam's direction under uniform light from that side; what it lets through,
// under light from the other side.
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "src/render/sampling/directions.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/light/estimate.h"
#include "tests/light/photons.h"
#include "tests/light/reference_table.h"

namespace firn::test::media {
namespace {

// Opaque and black, on one side of a horizontal plane.
void add_black_half(RenderSetup& setup, double height, bool above) {
  Shape plane = floor_plane(height);
  if (above) plane.pose.rotation = Vec3(1, -1, -1).asDiagonal();
  add_object(setup, plane, add_surface(setup, SurfaceKind::diffuse, 0));
}

RenderSetup slab_setup(const Medium& medium, Integrator integrator = Integrator::path) {
  RenderSetup setup = empty_setup(Vec3(0, 1, 0), Vec3::Zero(), 1, 1, 1, 100000);
  setup.image.integrator = integrator;
  setup.media.push_back(medium);
  setup.lights.push_back(ConstantLight{Vec3f::Ones()});
  return setup;
}

Estimate reflected(const Medium& medium, double mu, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  if (std::isfinite(medium.thickness)) add_black_half(setup, -1.1, false);
  const Vec3 from(std::sqrt(1 - mu * mu), mu, 0);
  return radiance_along(setup, {}, from, Vec3::Zero(), side, samples);
}

Estimate transmitted(const Medium& medium, double mu, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  add_black_half(setup, 1.5, true);
  const Vec3 from(std::sqrt(1 - mu * mu), mu, 0);
  return radiance_along(setup, {}, from, Vec3::Zero(), side, samples);
}

// Light that falls on a slab from all sides alike: a tiny white face over it, in a scene of `of`, sees the
// mean.
Estimate seen_by_a_face(RenderSetup setup, int side, int samples) {
  Shape box;
  box.form = Box{Vec3::Constant(5e-4)};
  box.pose.translation = Vec3(0, 1 + 5e-4, 0);
  add_object(setup, box, add_surface(setup, SurfaceKind::diffuse, 1));
  return radiance_along(setup, {}, Vec3(0, 0.9, 0), Vec3(0, 1, 0), side, samples);
}
Estimate reflected_diffuse(const Medium& medium, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  if (std::isfinite(medium.thickness)) add_black_half(setup, -1.1, false);
  return seen_by_a_face(setup, side, samples);
}
Estimate transmitted_diffuse(const Medium& medium, int side, int samples) {
  RenderSetup setup = slab_setup(medium);
  add_black_half(setup, 1.5, true);
  return seen_by_a_face(setup, side, samples);
}

double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

constexpr int kSide = 16;
constexpr int kSlabSamples = 24;  // a pixel: 6144 paths a number

// For figures as many samples as it takes for an error of at most half a percent or 1e-4, reckoned from those
// before.
template <class Measure>
Estimate fine(double expected, int samples, const Measure& measure) {
  Estimate seen = measure(samples);
  const double error = std::max(0.005 * expected, 1e-4);
  while (makes_figures() && seen.error > error) {
    samples = static_cast<int>(samples * (1.25 * std::pow(seen.error / error, 2) + 0.2));
    seen = measure(samples);
  }
  return seen;
}

}  // namespace

TEST_CASE("slabs reflect and let through what adding-doubling says", "[light][figure][slow]") {
  struct Asked {
    std::string name, row;
    double a, g, tau, expected;
    std::function<Estimate(int samples)> measure;
  };
  std::vector<Asked> asked;
  for (auto& row : reference_table("slab_rt_matched")) {
    const double a = number(row["a"]), g = number(row["g"]), tau = number(row["tau"]);
    const Medium medium = slab(a, g, tau);
    const auto ask = [&](const std::string& name, const auto& measure) {
      asked.push_back({name, "a " + row["a"] + " g " + row["g"] + " tau " + row["tau"], a, g, tau,
                       number(row[name]), measure});
    };
    const bool ends = row["tau"] != "inf";
    for (const bool steep : {true, false}) {
      const double mu = steep ? 1 : 0.5;
      const std::string tail = steep ? "mu0_1" : "mu0_05";
      ask("R_" + tail, [=](int samples) { return reflected(medium, mu, kSide, samples); });
      if (ends) ask("T_" + tail, [=](int samples) { return transmitted(medium, mu, kSide, samples); });
    }
    ask("R_diffuse", [=](int samples) { return reflected_diffuse(medium, kSide, samples); });
    if (ends) ask("T_diffuse", [=](int samples) { return transmitted_diffuse(medium, kSide, samples); });
  }
  const auto all = side_by_side(
      asked.size(), [&](std::size_t k) { return fine(asked[k].expected, kSlabSamples, asked[k].measure); });
  Curve curve("light_slab", "series,a,g,tau,expected,measured,error");
  Scores scores;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto& [name, row, a, g, tau, expected, measure] = asked[k];
    const Estimate& seen = all[k];
    INFO(row << " " << name << ": " << seen.mean << " +- " << seen.error << ", expected " << expected);
    // Light that one path in a hundred thousand brings has no error bar of its own.
    CHECK(std::fabs(seen.mean - expected) < 4.5 * std::max(seen.error, 1e-4));
    if (seen.error > 1e-4) scores.add(seen.mean, expected, seen.error);
    curve.add(name, {a, g, tau, expected, seen.mean, seen.error});
  }
  require_unbiased(scores);
}

TEST_CASE("a half space of isotropic scatterers shines as Chandrasekhar's H functions", "[light][figure]") {
  // Albedo of the plane, as its radiance under uniform light; and the radiance at mu under a beam from mu0 =
  // 0.7: L = a / (4 pi) mu0 / (mu + mu0) H(mu) H(mu0) for a beam of unit irradiance across itself.
  struct Asked {
    std::string a;
    double mu, plane_albedo, radiance;
  };
  std::vector<Asked> asked;
  std::map<std::string, double> h_of_beam;  // H(mu0)
  for (auto& row : reference_table("hfunction_isotropic"))
    if (row["mu"] == "0.7") h_of_beam[row["a"]] = number(row["H"]);
  for (auto& row : reference_table("hfunction_isotropic")) {
    if (row["mu"] == "diffuse") continue;
    const double a = number(row["a"]), mu = number(row["mu"]);
    const double beam = a / (4 * kPi) * 0.7 / (mu + 0.7) * number(row["H"]) * h_of_beam[row["a"]];
    asked.push_back({row["a"], mu, number(row["plane_albedo"]), beam});
  }
  // Nearer to 1 walks are longer, up to 1000 collisions in the mean, and have less to tell.
  const auto samples = [&asked](std::size_t k, int few) { return number(asked[k].a) > 0.995 ? 4 : few; };
  const auto planes = side_by_side(asked.size(), [&](std::size_t k) {
    const Medium medium = slab(number(asked[k].a), 0, INFINITY);
    return fine(asked[k].plane_albedo, samples(k, 16),
                [&](int its) { return reflected(medium, asked[k].mu, kSide, its); });
  });
  const auto radiances = side_by_side(asked.size(), [&](std::size_t k) {
    RenderSetup setup = slab_setup(slab(number(asked[k].a), 0, INFINITY));
    setup.lights = {SunLight{Vec3(-std::sqrt(1 - 0.49), 0.7, 0), 0.01, Vec3f::Ones()}};
    const double mu = asked[k].mu;
    const Vec3 from(0, mu, std::sqrt(1 - mu * mu));
    return fine(asked[k].radiance, samples(k, 32),
                [&](int its) { return radiance_along(setup, {}, from, Vec3::Zero(), kSide, its); });
  });
  Curve albedo("light_plane_albedo", "series,mu,expected,measured,error"),
      radiance("light_half_space", "series,mu,expected,measured,error");
  Scores scores;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const Asked& its = asked[k];
    const auto check = [&](const Estimate& seen, double expected, Curve& curve) {
      INFO("a " << its.a << " mu " << its.mu << ": " << seen.mean << " +- " << seen.error << ", expected "
                << expected);
      CHECK(std::fabs(seen.mean - expected) < 4.5 * seen.error);
      scores.add(seen.mean, expected, seen.error);
      curve.add("a = " + its.a, {its.mu, expected, seen.mean, seen.error});
    };
    check(planes[k], its.plane_albedo, albedo);
    check(radiances[k], its.radiance, radiance);
  }
  require_unbiased(scores);
}

TEST_CASE("in a white furnace a medium that absorbs nothing cannot be seen", "[light][figure]") {
  struct Asked {
    Integrator integrator;
    double sigma, g;
  };
  std::vector<Asked> asked;
  for (const Integrator integrator : {Integrator::path, Integrator::bidirectional}) {
    for (const double sigma : {0.5, 10.0, 200.0}) {
      for (const double g : {-0.5, 0.0, 0.9}) asked.push_back({integrator, sigma, g});
    }
  }
  const auto ball = [&](std::size_t k, double absorbed, int samples) {
    Medium medium;
    medium.shape.form = Ball{0.2};
    medium.sigma_s = Vec3f::Constant(static_cast<float>(asked[k].sigma));
    medium.sigma_a = Vec3f::Constant(static_cast<float>(absorbed * asked[k].sigma));
    medium.g = static_cast<float>(asked[k].g);
    const RenderSetup setup = slab_setup(medium, asked[k].integrator);
    return radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, samples);
  };
  const auto white =
      side_by_side(asked.size(), [&](std::size_t k) { return ball(k, 0, makes_figures() ? 256 : 64); });
  const auto grey = side_by_side(asked.size(), [&](std::size_t k) { return ball(k, 0.1, 64); });
  Curve curve("light_furnace", "series,sigma,expected,measured,error");
  Scores scores;
  double sum = 0, squares = 0;
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const auto& [integrator, sigma, g] = asked[k];
    const Estimate& seen = white[k];
    INFO("sigma " << sigma << " g " << g << ": " << seen.mean << " +- " << seen.error);
    CHECK(std::fabs(seen.mean - 1) <= std::max(3.5 * seen.error, 1e-4));
    CHECK(seen.error < 6e-3);
    CHECK(grey[k].mean < 0.99);
    scores.add(seen.mean, 1, std::max(seen.error, 1e-6));
    sum += seen.mean, squares += seen.error * seen.error;
    const char* part = g < 0 ? "-0.5" : g > 0 ? "0.9" : "0";
    curve.add(std::string(integrator == Integrator::path ? "path" : "both ends") + ", g " + part,
              {sigma, 1, seen.mean, seen.error});
  }
  const double count = static_cast<double>(scores.size());
  CHECK(std::fabs(sum / count - 1) < std::max(1e-3, 3 * std::sqrt(squares) / count));
  require_unbiased(scores);
}

}  // namespace firn::test::media
