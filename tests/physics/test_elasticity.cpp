// SPDX-License-Identifier: MIT
// Elastic bodies against closed forms: the frequency of a bar, the sag of a column under its own weight.
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::elasticity {
namespace {

constexpr double kLength = 1;    // m
constexpr int kCells = 32;       // along it
constexpr double kSwing = 0.02;  // m/s, of its free end at the start

// A bar along +y from y = 0, two cells square, between frictionless rollers on its four sides, its foot on a
// sticky plane. Planes lie on grid nodes (n - 1/2 cells), where a node on the plane feels it and the next one
// does not.
SolverSetup bar(const Material& material, int cells) {
  SolverSetup setup;
  const double dx = setup.dx = kLength / cells;
  setup.snow.push_back(
      fill(Vec3(0.5, 0.5, 0.5) * dx, Vec3(2.5 * dx, kLength + 0.5 * dx, 2.5 * dx), dx, 2, material));
  setup.colliders.push_back(plane(Vec3(0, 0.5 * dx, 0), Vec3(0, 1, 0), Contact::sticky, 0));
  setup.colliders.push_back(plane(Vec3(0.5 * dx, 0, 0), Vec3(1, 0, 0), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(2.5 * dx, 0, 0), Vec3(-1, 0, 0), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 0.5 * dx), Vec3(0, 0, 1), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 2.5 * dx), Vec3(0, 0, -1), Contact::slip, 0));
  return setup;
}

// Mean height of the top layer of particles.
double top(const Solver& simulation) { return bounds_of(simulation.metrics()).max.y(); }

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

// s; the bar swings once, let go in its lowest mode. see(time, speed over that of the start) after each
// sample.
double period_of(const Material& material, int cells, const std::function<void(double, double)>& see) {
  SolverSetup setup = bar(material, cells);
  setup.gravity = Vec3::Zero();
  for (std::size_t i = 0; i < setup.snow[0].position.size(); ++i) {
    const double y = setup.snow[0].position[i].y() - 0.5 * setup.dx;
    setup.snow[0].velocity[i].y() = kSwing * std::sin(M_PI * y / (2 * kLength));
  }
  Solver simulation(best_kernels(), setup);
  // The momentum along the bar passes through zero at a quarter, three quarters, ... of the period.
  const double expected = 4 * kLength / elastic_moduli(material).p_wave_speed;
  const double start = vec(simulation.metrics().momentum).y();
  std::vector<double> zeros;
  double last = start, last_time = 0;
  while (zeros.size() < 5) {
    simulation.advance_to(simulation.time() + expected / 200);
    const double now = vec(simulation.metrics().momentum).y();
    see(simulation.time(), now / start);
    if (now * last < 0) zeros.push_back(last_time + (simulation.time() - last_time) * last / (last - now));
    last = now;
    last_time = simulation.time();
    REQUIRE(simulation.time() < 5 * expected);
  }
  return (zeros[4] - zeros[0]) / 2;
}

// A column under its own weight, on the mean: it swings about its equilibrium without damping, and the mean
// over whole periods is the equilibrium.
struct Sagging {
  double sag;                        // m, of its top
  std::vector<double> strain, lift;  // F along the column, m; layer by layer
};

Sagging sagging(const Material& material, int cells) {
  SolverSetup setup = bar(material, cells);
  setup.gravity = Vec3(0, -9.81, 0);
  const std::vector<Vec3> placed = setup.snow[0].position;
  Solver simulation(best_kernels(), setup);
  const double before = top(simulation);
  const double period = 4 * kLength / elastic_moduli(material).p_wave_speed;
  Sagging mean{0, std::vector<double>(2 * cells), std::vector<double>(2 * cells)};
  Snapshot snapshot;
  const int samples = 160;
  for (int i = 0; i < samples; ++i) {
    simulation.advance_to(2 * period * (i + 0.5) / samples);
    mean.sag += (before - top(simulation)) / samples;
    simulation.snapshot(snapshot);
    for (std::size_t k = 0; k < snapshot.size(); ++k) {  // between rollers, J is F along the column
      const Vec3& start = placed[snapshot.id[k]];
      const std::size_t layer = static_cast<std::size_t>(start.y() / (setup.dx / 2) - 1);
      mean.strain[layer] += material.density / snapshot.density[k] / (16 * samples);
      mean.lift[layer] += (vec(snapshot.world_position(k)).y() - start.y()) / (16 * samples);
    }
  }
  return mean;
}

}  // namespace

TEST_CASE("a fixed-free bar between rollers swings at c_p / (4 L)", "[physics][figure]") {
  const Material material = elastic();
  const double expected = 4 * kLength / elastic_moduli(material).p_wave_speed;
  Curve curve("bar", "series,time_s,velocity,expected"), finer("finer_bar", "series,cells,error,allowed");
  const double period = period_of(material, kCells, [&](double time, double speed) {
    curve.add("bar", {time, speed, std::cos(2 * M_PI * time / expected)});
  });
  CHECK(period == Approx(expected).epsilon(0.01));
  if (!makes_figures()) return;
  for (const int cells : {8, 16, 32, 64, 128}) {
    const double found = period_of(material, cells, [](double, double) {});
    finer.add("period of a bar", {double(cells), std::abs(found / expected - 1), 0.01});
  }
}

TEST_CASE(
    "a column between rollers sags under its weight to the height and the strain of its stress-strain law",
    "[physics][figure]") {
  Curve curve("self_weight", "series,height_m,displacement_m,expected_m");
  Curve finer("finer_column", "series,cells,error,allowed");
  struct Case {
    const char* name;
    kernels::MaterialKind model;
    double height;  // of a 1 m column at g = 9.81 m/s^2
    double base;    // F along it at its foot
  };
  for (const Case& expected : {Case{"fixed corotated", kKindOf<kernels::Snow>, 0.987387, 0.974774},
                               Case{"neo-Hookean", kKindOf<kernels::NeoHookean>, 0.987545, 0.97525}}) {
    const auto [sag, strain, lift] = sagging(elastic(expected.model), kCells);
    INFO(expected.name);
    CHECK(sag == Approx(kLength - expected.height).margin(1e-3));
    // The four layers next to the sticky plane are off by up to 5e-3 (one too stiff, the next too soft), so
    // the foot is read off the line through the lower half.
    const double foot = at_zero(strain, kCells);
    INFO("F at the foot " << foot << ", off by " << foot - expected.base);
    CHECK(foot == Approx(expected.base).margin(1e-3));
    for (std::size_t k = 0; k < lift.size(); ++k) {
      const double y = (static_cast<double>(k) + 0.5) * kLength / (2 * kCells);
      curve.add(expected.name, {y, lift[k], (expected.base - 1) * (y - y * y / (2 * kLength))});
    }
    for (std::size_t k = 4; k < strain.size(); ++k) {
      INFO("layer " << k);
      CHECK(strain[k] ==
            Approx(expected.base + (1 - expected.base) * (k + 0.5) / (2. * kCells)).margin(1e-3));
    }
    if (!makes_figures()) continue;
    for (const int cells : {8, 16, 32, 64, 128}) {
      const double off = sagging(elastic(expected.model), cells).sag - (kLength - expected.height);
      finer.add(std::string("height, ") + expected.name, {double(cells), std::abs(off), 1e-3});
    }
  }
}

}  // namespace firn::test::elasticity
