// SPDX-License-Identifier: MIT
// Elastic bodies against closed forms: the frequency of a bar, the sag of a column under its own weight.
#include <vector>

#include "tests/catch.h"
#include "tests/physics/curve.h"
#include "tests/physics/snow.h"

using namespace firn;
using namespace firn::test;

namespace {

constexpr double kLength = 1;  // m
constexpr int kCells = 32;     // along it
constexpr double kDx = kLength / kCells;

// A bar along +y from y = 0, two cells square, between frictionless rollers on its four sides, its foot on a
// sticky plane. Planes lie on grid nodes (n - 1/2 cells), where a node on the plane feels it and the next one
// does not.
SimulationSetup bar(const Material& material) {
  SimulationSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(
      fill(Vec3(0.5, 0.5, 0.5) * kDx, Vec3(2.5 * kDx, kLength + 0.5 * kDx, 2.5 * kDx), kDx, 2, material));
  setup.colliders.push_back(plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::sticky, 0));
  setup.colliders.push_back(plane(Vec3(0.5 * kDx, 0, 0), Vec3(1, 0, 0), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(2.5 * kDx, 0, 0), Vec3(-1, 0, 0), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 0.5 * kDx), Vec3(0, 0, 1), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 2.5 * kDx), Vec3(0, 0, -1), Contact::slip, 0));
  return setup;
}

// Mean height of the top layer of particles.
double top(const Simulation& simulation) { return simulation.metrics().bounds.max.y(); }

// The least squares line through (k + 1/2, values[k]), k < count, at 0.
double at_zero(const std::vector<double>& values, int count) {
  const double middle = 0.5 * count;
  double mean = 0, slope = 0, spread = 0;
  for (int k = 0; k < count; ++k) {
    const double offset = k + 0.5 - middle;
    mean += values[static_cast<std::size_t>(k)] / count;
    slope += offset * values[static_cast<std::size_t>(k)];
    spread += offset * offset;
  }
  return mean - slope / spread * middle;
}

}  // namespace

TEST_CASE("a fixed-free bar between rollers swings at c_p / (4 L)", "[physics][figure]") {
  const Material material = elastic();
  SimulationSetup setup = bar(material);
  setup.gravity = Vec3::Zero();
  for (std::size_t i = 0; i < setup.snow[0].position.size(); ++i) {
    const double y = setup.snow[0].position[i].y() - 0.5 * kDx;
    setup.snow[0].velocity[i].y() = 0.02 * std::sin(M_PI * y / (2 * kLength));
  }
  Simulation simulation(best_kernels(), setup);
  // The momentum along the bar passes through zero at a quarter, three quarters, ... of the period.
  const double expected = 4 * kLength / elastic_moduli(material).p_wave_speed;
  std::vector<double> zeros;
  double last = simulation.metrics().momentum.y(), last_time = 0;
  Curve curve("bar", "series,time_s,velocity_m_s,expected_m_s");
  const double start = last, mass = simulation.metrics().mass;
  while (zeros.size() < 5) {
    simulation.advance_to(simulation.time() + expected / 200, kNeverStop);
    const double now = simulation.metrics().momentum.y();
    curve.add("bar", {simulation.time(), now / mass,
                      start / mass * std::cos(2 * M_PI * simulation.time() / expected)});
    if (now * last < 0) zeros.push_back(last_time + (simulation.time() - last_time) * last / (last - now));
    last = now;
    last_time = simulation.time();
    REQUIRE(simulation.time() < 5 * expected);
  }
  const double period = (zeros[4] - zeros[0]) / 2;
  CHECK(period == Approx(expected).epsilon(0.01));
}

TEST_CASE(
    "a column between rollers sags under its weight to the height and the strain of its stress-strain law",
    "[physics][figure]") {
  Curve curve("self_weight", "series,height_m,displacement_m,expected_m");
  struct Case {
    kernels::MaterialKind model;
    double height;  // of a 1 m column at g = 9.81 m/s^2
    double base;    // F along it at its foot
  };
  for (const Case& expected : {Case{kKindOf<kernels::Snow>, 0.987387, 0.974774},
                               Case{kKindOf<kernels::NeoHookean>, 0.987545, 0.97525}}) {
    SimulationSetup setup = bar(elastic(expected.model));
    setup.gravity = Vec3(0, -9.81, 0);
    const std::vector<Vec3> placed = setup.snow[0].position;
    Simulation simulation(best_kernels(), setup);
    const double before = top(simulation);
    // The column swings about its equilibrium without damping: the mean over whole periods is the
    // equilibrium.
    const double period = 4 * kLength / elastic_moduli(elastic()).p_wave_speed;
    double sag = 0;
    std::vector<double> strain(2 * kCells), lift(2 * kCells);  // F along the column, m; layer by layer
    Snapshot snapshot;
    const int samples = 160;
    for (int i = 0; i < samples; ++i) {
      simulation.advance_to(2 * period * (i + 0.5) / samples, kNeverStop);
      sag += (before - top(simulation)) / samples;
      simulation.snapshot(snapshot);
      for (std::size_t k = 0; k < snapshot.size(); ++k) {  // between rollers, J is F along the column
        const std::size_t layer = static_cast<std::size_t>(placed[snapshot.id[k]].y() / (kDx / 2) - 1);
        strain[layer] += 400. / snapshot.density[k] / (16 * samples);
        lift[layer] += (snapshot.world_position(k).y() - placed[snapshot.id[k]].y()) / (16 * samples);
      }
    }
    INFO(static_cast<int>(expected.model));
    CHECK(sag == Approx(kLength - expected.height).margin(1e-3));
    // The four layers next to the sticky plane are off by up to 5e-3 (one too stiff, the next too soft), so
    // the foot is read off the line through the lower half.
    const double foot = at_zero(strain, kCells);
    INFO("F at the foot " << foot << ", off by " << foot - expected.base);
    CHECK(foot == Approx(expected.base).margin(1e-3));
    for (std::size_t k = 0; k < lift.size(); ++k) {
      const double y = (static_cast<double>(k) + 0.5) * kDx / 2;
      curve.add(expected.model == kKindOf<kernels::Snow> ? "fixed corotated" : "neo-Hookean",
                {y, lift[k], (expected.base - 1) * (y - y * y / (2 * kLength))});
    }
    for (std::size_t k = 4; k < strain.size(); ++k) {
      INFO("layer " << k);
      CHECK(strain[k] ==
            Approx(expected.base + (1 - expected.base) * (k + 0.5) / (2. * kCells)).margin(1e-3));
    }
  }
}
