// SPDX-License-Identifier: MIT
// Homogeneous media against transport theory. By reciprocity the part of a beam that a slab reflects is the
// radiance that it shows in the beam's direction under uniform light from that side; what it lets through,
// under light from the other side.
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "src/render/sampling/directions.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/light/estimate.h"
#include "tests/light/photons.h"
#include "tests/light/reference_table.h"

using namespace firn;
using namespace firn::test;

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

// For figures as many samples as it takes for an error of half a percent or 1e-4, reckoned from the first
// ones.
template <class Measure>
Estimate fine(double expected, const Measure& measure) {
  const Estimate first = measure(kSlabSamples);
  if (!makes_figures()) return first;
  const double more = std::pow(first.error / std::max(0.005 * expected, 1e-4), 2);
  return more > 1 ? measure(static_cast<int>(kSlabSamples * std::min(1.1 * more + 0.1, 8.0))) : first;
}

}  // namespace

TEST_CASE("slabs reflect and let through what adding-doubling says", "[light][figure]") {
  Curve curve("light_slab", "series,a,g,tau,expected,measured,error");
  Scores scores;
  for (auto& row : reference_table("slab_rt_matched")) {
    const Medium medium = slab(number(row["a"]), number(row["g"]), number(row["tau"]));
    const auto check = [&](const std::string& name, const auto& measure) {
      const double expected = number(row[name]);
      const Estimate seen = fine(expected, measure);
      INFO("a " << row["a"] << " g " << row["g"] << " tau " << row["tau"] << " " << name << ": " << seen.mean
                << " +- " << seen.error << ", expected " << expected);
      // Light that one path in a hundred thousand brings has no error bar of its own.
      CHECK(std::fabs(seen.mean - expected) < 4.5 * std::max(seen.error, 1e-4));
      if (seen.error > 1e-4) scores.add(seen.mean, expected, seen.error);
      curve.add(name,
                {number(row["a"]), number(row["g"]), number(row["tau"]), expected, seen.mean, seen.error});
    };
    const bool ends = row["tau"] != "inf";
    for (const bool steep : {true, false}) {
      const double mu = steep ? 1 : 0.5;
      const std::string tail = steep ? "mu0_1" : "mu0_05";
      check("R_" + tail, [&](int samples) { return reflected(medium, mu, kSide, samples); });
      if (ends) check("T_" + tail, [&](int samples) { return transmitted(medium, mu, kSide, samples); });
    }
    check("R_diffuse", [&](int samples) { return reflected_diffuse(medium, kSide, samples); });
    if (ends) check("T_diffuse", [&](int samples) { return transmitted_diffuse(medium, kSide, samples); });
  }
  require_unbiased(scores);
}

TEST_CASE("a half space of isotropic scatterers shines as Chandrasekhar's H functions", "[light][figure]") {
  // Albedo of the plane, as its radiance under uniform light; and the radiance at mu under a beam from mu0 =
  // 0.7: L = a / (4 pi) mu0 / (mu + mu0) H(mu) H(mu0) for a beam of unit irradiance across itself.
  std::map<std::string, std::map<std::string, double>> h;
  Curve albedo("light_plane_albedo", "series,mu,expected,measured,error"),
      radiance("light_half_space", "series,mu,expected,measured,error");
  const int finer = makes_figures() ? 2 : 1;
  Scores scores;
  for (auto& row : reference_table("hfunction_isotropic")) {
    if (row["mu"] == "diffuse") continue;
    h[row["a"]][row["mu"]] = number(row["H"]);
    // Nearer to 1 walks are longer, up to 1000 collisions in the mean, and have less to tell.
    const Estimate seen = reflected(slab(number(row["a"]), 0, INFINITY), number(row["mu"]), kSide,
                                    finer * (number(row["a"]) > 0.995 ? 4 : 16));
    INFO("a " << row["a"] << " mu " << row["mu"] << ": " << seen.mean << " +- " << seen.error);
    scores.add(seen.mean, number(row["plane_albedo"]), seen.error);
    albedo.add("a = " + row["a"], {number(row["mu"]), number(row["plane_albedo"]), seen.mean, seen.error});
  }
  for (auto& [a, of] : h) {
    RenderSetup setup = slab_setup(slab(number(a), 0, INFINITY));
    setup.lights = {SunLight{Vec3(-std::sqrt(1 - 0.49), 0.7, 0), 0.01, Vec3f::Ones()}};
    for (auto& [mu, value] : of) {
      const double m = number(mu);
      const Estimate seen = radiance_along(setup, {}, Vec3(0, m, std::sqrt(1 - m * m)), Vec3::Zero(), kSide,
                                           finer * (number(a) > 0.995 ? 4 : 32));
      const double expected = number(a) / (4 * kPi) * 0.7 / (m + 0.7) * value * of["0.7"];
      INFO("a " << a << " mu " << mu << ": " << seen.mean << " +- " << seen.error << ", expected "
                << expected);
      CHECK(std::fabs(seen.mean - expected) < 4.5 * seen.error);
      scores.add(seen.mean, expected, seen.error);
      radiance.add("a = " + a, {m, expected, seen.mean, seen.error});
    }
  }
  require_unbiased(scores);
}

TEST_CASE("in a white furnace a medium that absorbs nothing cannot be seen", "[light][figure]") {
  Curve curve("light_furnace", "series,sigma,expected,measured,error");
  Scores scores;
  double sum = 0, squares = 0;
  const int samples = makes_figures() ? 256 : 64;
  for (const Integrator integrator : {Integrator::path, Integrator::bidirectional}) {
    for (const double sigma : {0.5, 10.0, 200.0}) {
      for (const double g : {-0.5, 0.0, 0.9}) {
        Medium medium;
        medium.shape.form = Ball{0.2};
        medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma));
        medium.g = static_cast<float>(g);
        RenderSetup setup = slab_setup(medium, integrator);
        const Estimate seen = radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, samples);
        INFO("sigma " << sigma << " g " << g << ": " << seen.mean << " +- " << seen.error);
        CHECK(std::fabs(seen.mean - 1) <= std::max(3.5 * seen.error, 1e-4));
        CHECK(seen.error < 6e-3);
        scores.add(seen.mean, 1, std::max(seen.error, 1e-6));
        sum += seen.mean, squares += seen.error * seen.error;
        curve.add(std::string(integrator == Integrator::path ? "path" : "both ends") + ", g " +
                      (g < 0   ? "-0.5"
                       : g > 0 ? "0.9"
                               : "0"),
                  {sigma, 1, seen.mean, seen.error});
        setup.media[0].sigma_a = Vec3f::Constant(0.1f * static_cast<float>(sigma));
        CHECK(radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, 64).mean < 0.99);
      }
    }
  }
  const double count = static_cast<double>(scores.size());
  CHECK(std::fabs(sum / count - 1) < std::max(1e-3, 3 * std::sqrt(squares) / count));
  require_unbiased(scores);
}
