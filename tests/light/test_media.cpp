// SPDX-License-Identifier: MIT
// Homogeneous media against transport theory. By reciprocity the part of a beam that a slab reflects is the radiance
// that it shows in the beam's direction under uniform light from that side; what it lets through, under light from the
// other side.
#include <cmath>
#include <cstdlib>
#include <string>

#include "src/core/rng.h"
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
        // As many paths as bring the error to half a percent, or 1e-4 where that is more.
        const double wanted = std::max(0.005 * expected, 1e-4);
        const Estimate pilot = measure(medium, mu, kSide, 16);
        const double factor = std::pow(pilot.error / wanted, 2);
        const int samples = static_cast<int>(std::min(std::max(16 * factor, 16.0), 4096.0));
        const Estimate seen = measure(medium, mu, kSide, samples);
        INFO("a " << row["a"] << " g " << row["g"] << " tau " << row["tau"] << " " << name << ": " << seen.mean
                  << " +- " << seen.error << ", expected " << expected);
        CHECK(std::fabs(seen.mean - expected) < 4.5 * std::max(seen.error, 1e-6));
        if (seen.error > 1e-6) scores.add(seen.mean, expected, seen.error);
      };
      check("R_" + tail, reflected);
      if (row["tau"] != "inf") check("T_" + tail, transmitted);
    }
  }
  require_unbiased(scores);
}
