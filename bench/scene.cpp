// SPDX-License-Identifier: MIT
#include "bench/scene.h"

#include <algorithm>
#include <cmath>

#include "firn/error.h"
#include "src/core/rng.h"

namespace firn::bench {

namespace {

constexpr double kSpacing = kSceneDx / 2;  // m, of the particles
constexpr double kTooHigh = 4;             // m, more than a run falls
constexpr float kPackedJp = 0.9f;          // of the settled block: 2.7 times as stiff as fresh

PlacedSnow fresh_snow() {
  PlacedSnow snow;
  snow.name = "snow";
  snow.particle_volume = kSpacing * kSpacing * kSpacing;
  return snow;
}

PlacedSnow ball(std::size_t particles, double clearance) {
  PlacedSnow snow = fresh_snow();
  const double radius = kSpacing * std::cbrt(3.0 * static_cast<double>(particles) / (4 * M_PI));
  const Vec3 center(0, radius + clearance, 0);
  const int n = static_cast<int>(std::ceil(radius / kSpacing)) + 1;
  for (int i = -n; i < n; ++i) {
    for (int j = -n; j < n; ++j) {
      for (int k = -n; k < n; ++k) {
        const Vec3 x = kSpacing * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (x.norm() < radius) snow.position.push_back(center + x);
      }
    }
  }
  snow.velocity.assign(snow.position.size(), Vec3(0, -10, 0));
  return snow;
}

// Three times as wide as it is high.
PlacedSnow packed_block(std::size_t particles) {
  PlacedSnow snow = fresh_snow();
  const auto even = [](double layers) { return std::max(2, 2 * static_cast<int>(layers / 2 + 0.5)); };
  const int height = even(std::cbrt(static_cast<double>(particles) / 9));
  const int width = even(std::sqrt(static_cast<double>(particles) / height));
  for (int i = 0; i < width; ++i) {
    for (int j = 0; j < height; ++j) {
      for (int k = 0; k < width; ++k) {
        Vec3 x(i, j, k);
        for (std::uint64_t axis = 0; axis < 3; ++axis) {
          x[static_cast<int>(axis)] += uniform_double(hash_keys(snow.position.size(), axis));
        }
        snow.position.push_back(kSpacing * x);
      }
    }
  }
  snow.velocity.assign(snow.position.size(), Vec3::Zero());
  snow.packing.assign(snow.position.size(), kPackedJp);
  return snow;
}

PlacedSnow snow_of_scene(const std::string& name, std::size_t particles) {
  if (name == "impact") return ball(particles, 2 * kSceneDx);
  if (name == "falling") return ball(particles, kTooHigh);
  if (name == "settled") return packed_block(particles);
  throw Error(ErrorCode::usage, "--scene", "'" + name + "' is not one of: impact, falling, settled");
}

}  // namespace

SolverSetup bench_scene(const std::string& name, std::size_t particles) {
  SolverSetup setup;
  setup.dx = kSceneDx;
  setup.sleep = false;  // every particle-step that is counted is made
  setup.snow.push_back(snow_of_scene(name, particles));
  Collider floor;
  floor.shape.form = HalfSpace{};
  floor.friction = 0.5;
  setup.colliders.push_back(floor);
  return setup;
}

double scene_speed(const SolverSetup& setup) {
  double top = 0, start = 0;
  const PlacedSnow& snow = setup.snow.front();
  for (std::size_t i = 0; i < snow.position.size(); ++i) {
    top = std::max(top, snow.position[i].y());
    start = std::max(start, snow.velocity[i].norm());
  }
  return std::sqrt(start * start + 2 * setup.gravity.norm() * top);
}

}  // namespace firn::bench
