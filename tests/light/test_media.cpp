// SPDX-License-Identifier: MIT
// Homogeneous media against transport theory. By reciprocity the part of a beam that a slab reflects is the
// radiance that it shows in the beam's direction under uniform light from that side; what it lets through,
// under light from the other side.
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>

#include "src/core/rng.h"
#include "src/render/directions.h"
#include "src/render/media.h"
#include "src/render/phase.h"
#include "tests/catch.h"
#include "tests/light/estimate.h"
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

// 1 m thick, its upper side at height 0.
Medium slab(double albedo, double g, double tau) {
  Medium medium;
  medium.shape = floor_plane(0);
  const bool thick = std::isinf(tau);
  const double sigma = thick ? 1 : tau;
  if (!thick) medium.thickness = 1;
  medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma * albedo));
  medium.sigma_a = Vec3f::Constant(static_cast<float>(sigma * (1 - albedo)));
  medium.g = static_cast<float>(g);
  return medium;
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

double number(const std::string& text) { return std::strtod(text.c_str(), nullptr); }

constexpr int kSide = 16;
constexpr int kSlabSamples = 24;  // a pixel: 6144 paths a number

}  // namespace

TEST_CASE("slabs reflect and let through what adding-doubling says", "[light]") {
  Scores scores;
  for (auto& row : reference_table("slab_rt_matched")) {
    const Medium medium = slab(number(row["a"]), number(row["g"]), number(row["tau"]));
    for (const bool steep : {true, false}) {
      const double mu = steep ? 1 : 0.5;
      const std::string tail = steep ? "mu0_1" : "mu0_05";
      const auto check = [&](const std::string& name, Estimate (*measure)(const Medium&, double, int, int)) {
        const double expected = number(row[name]);
        const Estimate seen = measure(medium, mu, kSide, kSlabSamples);
        INFO("a " << row["a"] << " g " << row["g"] << " tau " << row["tau"] << " " << name << ": "
                  << seen.mean << " +- " << seen.error << ", expected " << expected);
        // Light that one path in a hundred thousand brings has no error bar of its own.
        CHECK(std::fabs(seen.mean - expected) < 4.5 * std::max(seen.error, 1e-4));
        if (seen.error > 1e-4) scores.add(seen.mean, expected, seen.error);
      };
      check("R_" + tail, reflected);
      if (row["tau"] != "inf") check("T_" + tail, transmitted);
    }
  }
  require_unbiased(scores);
}

TEST_CASE("a half space of isotropic scatterers shines as Chandrasekhar's H functions", "[light]") {
  // Albedo of the plane, as its radiance under uniform light; and the radiance at mu under a beam from mu0 =
  // 0.7: L = a / (4 pi) mu0 / (mu + mu0) H(mu) H(mu0) for a beam of unit irradiance across itself.
  std::map<std::string, std::map<std::string, double>> h;
  Scores scores;
  for (auto& row : reference_table("hfunction_isotropic")) {
    if (row["mu"] == "diffuse" || number(row["a"]) > 0.99) continue;  // nearer to 1 the walks have no end
    h[row["a"]][row["mu"]] = number(row["H"]);
    const Estimate seen = reflected(slab(number(row["a"]), 0, INFINITY), number(row["mu"]), kSide, 16);
    INFO("a " << row["a"] << " mu " << row["mu"] << ": " << seen.mean << " +- " << seen.error);
    scores.add(seen.mean, number(row["plane_albedo"]), seen.error);
  }
  for (auto& [a, of] : h) {
    RenderSetup setup = slab_setup(slab(number(a), 0, INFINITY));
    setup.lights = {SunLight{Vec3(-std::sqrt(1 - 0.49), 0.7, 0), 0.01, Vec3f::Ones()}};
    for (auto& [mu, value] : of) {
      const double m = number(mu);
      const Estimate seen =
          radiance_along(setup, {}, Vec3(0, m, std::sqrt(1 - m * m)), Vec3::Zero(), kSide, 32);
      const double expected = number(a) / (4 * kPi) * 0.7 / (m + 0.7) * value * of["0.7"];
      INFO("a " << a << " mu " << mu << ": " << seen.mean << " +- " << seen.error << ", expected "
                << expected);
      CHECK(std::fabs(seen.mean - expected) < 4.5 * seen.error);
      scores.add(seen.mean, expected, seen.error);
    }
  }
  require_unbiased(scores);
}

TEST_CASE("in a white furnace a medium that absorbs nothing cannot be seen", "[light]") {
  Scores scores;
  for (const Integrator integrator : {Integrator::path, Integrator::bidirectional}) {
    for (const double sigma : {0.5, 10.0, 200.0}) {
      for (const double g : {-0.5, 0.0, 0.9}) {
        Medium medium;
        medium.shape.form = Ball{0.2};
        medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma));
        medium.g = static_cast<float>(g);
        RenderSetup setup = slab_setup(medium, integrator);
        const Estimate seen = radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, 64);
        INFO("sigma " << sigma << " g " << g << ": " << seen.mean << " +- " << seen.error);
        CHECK(std::fabs(seen.mean - 1) <= std::max(3.5 * seen.error, 1e-4));
        CHECK(seen.error < 6e-3);
        scores.add(seen.mean, 1, std::max(seen.error, 1e-6));
        setup.media[0].sigma_a = Vec3f::Constant(0.1f * static_cast<float>(sigma));
        CHECK(radiance_along(setup, {}, Vec3(0.05, 0.1, 1), Vec3(0.05, 0, 0), kSide, 64).mean < 0.99);
      }
    }
  }
  require_unbiased(scores);
}

TEST_CASE("light walks 4V/S through a convex body that scatters, whatever is in it", "[light]") {
  // Light from all sides enters a ball evenly over its surface, cosine-distributed.
  for (const double sigma : {0.5, 5.0, 50.0}) {
    for (const double g : {0.0, 0.8}) {
      Medium medium;
      medium.shape.form = Ball{1};
      medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma));
      medium.g = static_cast<float>(g);
      MediumSet media({medium});
      media.place(Vec3::Zero());
      constexpr int kPhotons = 40000;
      double sum = 0, squares = 0;
      std::uint64_t key = 5;
      const auto draw = [&key] {
        const Sample2 at{uniform_float(mix64(key)), uniform_float(mix64(key + 1))};
        key += 2;
        return at;
      };
      for (int photon = 0; photon < kPhotons; ++photon) {
        Vec3f p(0, 0, 1), d = cosine_direction(Vec3f(0, 0, -1), draw());
        double length = 0;
        for (;;) {
          const auto found = media.fly(p, d, INFINITY, mix64(key++));
          const double along = p.cast<double>().dot(d.cast<double>());
          if (found.medium < 0) {
            length += -along + std::sqrt(std::max(along * along - p.cast<double>().squaredNorm() + 1, 0.0));
            break;
          }
          length += found.t;
          p += found.t * d;
          d = phase_direction(medium.g, d, draw());
        }
        sum += length;
        squares += length * length;
      }
      const double mean = sum / kPhotons, error = std::sqrt((squares / kPhotons - mean * mean) / kPhotons);
      INFO("sigma " << sigma << " g " << g << ": " << mean << " +- " << error);
      CHECK(std::fabs(mean - 4.0 / 3) < 3.5 * error);
      CHECK(error < 0.03);
    }
  }
}

TEST_CASE("a photon collides (1 - R) / (1 - albedo) times in a half space", "[light]") {
  // Analog: a photon survives a collision with the chance of the albedo. Absorbed ones are those that did not
  // leave.
  for (const double albedo : {0.5, 0.9, 0.99}) {
    MediumSet media({slab(albedo, 0.75, INFINITY)});
    media.place(Vec3::Zero());
    constexpr int kPhotons = 20000;
    double collisions = 0, squares = 0;
    int left = 0;
    std::uint64_t key = 77;
    for (int photon = 0; photon < kPhotons; ++photon) {
      Vec3f p = Vec3f::Zero(), d(0, -1, 0);
      int n = 0;
      for (;;) {
        const auto found = media.fly(p, d, INFINITY, mix64(key++));
        if (found.medium < 0) {
          ++left;
          break;
        }
        p += found.t * d;
        ++n;
        if (uniform_double(mix64(key++)) >= albedo) break;
        d = phase_direction(0.75f, d, {uniform_float(mix64(key)), uniform_float(mix64(key + 1))});
        key += 2;
      }
      collisions += n;
      squares += static_cast<double>(n) * n;
    }
    const double mean = collisions / kPhotons, reflected_part = static_cast<double>(left) / kPhotons;
    const double error = std::sqrt((squares / kPhotons - mean * mean) / kPhotons) +
                         std::sqrt(reflected_part * (1 - reflected_part) / kPhotons) / (1 - albedo);
    INFO("albedo " << albedo);
    CHECK(std::fabs(mean - (1 - reflected_part) / (1 - albedo)) < 3 * error);
  }
}
