// SPDX-License-Identifier: MIT
// What the metrics tell of a frame: percentiles of density, the front on a slope, the same on any number of
// threads.
#include <algorithm>
#include <numeric>
#include <vector>

#include "src/core/rng.h"
#include "src/mpm/percentile.h"
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

using namespace firn;
using namespace firn::test;

TEST_CASE("a percentile by mass is the value at which that part of the mass is reached", "[physics]") {
  const std::vector<float> value = {3, -2, 0, 1e-3f, 7, -5};
  const std::vector<float> mass = {1, 2, 1, 4, 1, 1};  // in order of value: 1 2 1 4 1 1
  CHECK(mass_percentile(value, mass.data(), 0.05) == -5);
  CHECK(mass_percentile(value, mass.data(), 0.2) == -2);
  CHECK(mass_percentile(value, mass.data(), 0.35) == 0);
  CHECK(mass_percentile(value, mass.data(), 0.5) == 1e-3f);
  CHECK(mass_percentile(value, mass.data(), 0.85) == 3);
  CHECK(mass_percentile(value, mass.data(), 1) == 7);
  CHECK(mass_percentile({}, mass.data(), 0.5) == 0);
}

TEST_CASE("percentiles of many particles are exact", "[physics]") {
  const std::size_t count = 300001;
  std::vector<float> value(count), mass(count);
  for (std::size_t i = 0; i < count; ++i) {
    value[i] = 2000 * uniform_float(hash_keys(1, i)) - 500;
    mass[i] = 1e-6f * (1 + uniform_float(hash_keys(2, i)));
  }
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return value[a] < value[b]; });
  const double all = std::accumulate(mass.begin(), mass.end(), 0.0);
  for (const double part : {0.05, 0.5, 0.99}) {
    double below = 0;
    std::size_t k = 0;
    while (below + mass[order[k]] < part * all) below += mass[order[k++]];
    CHECK(mass_percentile(value, mass.data(), part) == value[order[k]]);
  }
}

TEST_CASE("snow as placed has its own density, loose and packed snow what Jp makes of it", "[physics]") {
  SolverSetup setup;
  setup.dx = 0.02;
  setup.snow.push_back(fill(Vec3::Zero(), Vec3(0.2, 0.2, 0.2), setup.dx, 2, Material{}));
  const std::size_t count = setup.snow[0].position.size();
  setup.snow[0].packing.assign(count, 1);
  for (std::size_t i = 0; i < count / 5; ++i) setup.snow[0].packing[i] = 0.8f;               // 500 kg/m^3
  for (std::size_t i = count - count / 5; i < count; ++i) setup.snow[0].packing[i] = 1.25f;  // 320 kg/m^3
  const Metrics m = Solver(best_kernels(), setup).metrics();
  CHECK(m.density_p05 == Approx(320).epsilon(1e-5));
  CHECK(m.density_p50 == Approx(400).epsilon(1e-5));
  CHECK(m.density_p95 == Approx(500).epsilon(1e-5));
}

TEST_CASE("the sign of Jp, lost cohesion, does not count in the density", "[physics]") {
  SolverSetup setup;
  setup.dx = 0.02;
  setup.snow.push_back(
      fill(Vec3::Zero(), Vec3(0.2, 0.2, 0.2), setup.dx, 2, find_preset("weak_layer").material));
  setup.snow[0].packing.assign(setup.snow[0].position.size(), -0.8f);
  const Metrics m = Solver(best_kernels(), setup).metrics();
  CHECK(m.density_p50 == Approx(150 / 0.8).epsilon(1e-5));
  CHECK(m.volume == Approx(0.8 * 0.008).epsilon(1e-5));
}

TEST_CASE("the front runs down the steepest plane, and along +x where none is tilted", "[physics]") {
  SolverSetup setup;
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0, 1, 0), Contact::separating, 0.3));
  CHECK(front_direction(setup) == Vec3(1, 0, 0));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(1, 0, 0), Contact::slip, 0));  // a wall
  CHECK(front_direction(setup) == Vec3(1, 0, 0));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0, 1, 0.1), Contact::separating, 0.3));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(-0.6, 0.8, 0), Contact::separating, 0.3));
  CHECK((front_direction(setup) - Vec3(-0.8, -0.6, 0)).norm() < 1e-12);
}

TEST_CASE("the front of a slab that slides without friction gains g sin t^2 / 2", "[physics][figure]") {
  Curve curve("front", "series,time_s,way_m,expected_m");
  SolverSetup setup;
  setup.dx = 0.02;
  setup.gravity = 9.81 * Vec3(0.6, -0.8, 0);  // a slope of 36.87 degrees, seen along it
  setup.colliders.push_back(plane(Vec3(0, 0.01, 0), Vec3(0, 1, 0), Contact::separating, 0));
  setup.snow.push_back(fill(Vec3(0, 0.015, 0), Vec3(0.3, 0.115, 0.2), setup.dx, 2, Material{}));
  Solver simulation(best_kernels(), setup);
  const double start = simulation.metrics().front;
  CHECK(start == Approx(0.3).margin(0.02));
  for (int k = 1; k <= 20; ++k) {
    const double time = 0.015 * k;
    simulation.advance_to(time);
    curve.add("slab", {time, simulation.metrics().front - start, 0.6 * 9.81 * time * time / 2});
  }
  CHECK(simulation.metrics().front - start == Approx(0.6 * 9.81 * 0.09 / 2).epsilon(0.02));
}

TEST_CASE("the metrics have the same bits on 1 thread and on 3", "[physics]") {
  SolverSetup setup;
  setup.dx = 0.02;
  setup.snow.push_back(ball(Vec3(0, 0.1, 0), 0.09, setup.dx, Material{}, Vec3(5, -10, 0)));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0.1, 1, 0), Contact::separating, 0.3));
  Metrics of[2];
  for (const int run : {0, 1}) {
    with_threads(1 + 2 * run, [&] {
      Solver simulation(best_kernels(), setup);
      for (int i = 0; i < 60; ++i) simulation.step(simulation.stable_step().dt);
      of[run] = simulation.metrics();
    });
  }
  CHECK(vec(of[0].momentum) == vec(of[1].momentum));
  CHECK(of[0].kinetic_energy == of[1].kinetic_energy);
  CHECK(of[0].elastic_energy == of[1].elastic_energy);
  CHECK(of[0].density_p05 == of[1].density_p05);
  CHECK(of[0].density_p95 == of[1].density_p95);
  CHECK(of[0].density_p05 < of[0].density_p95);
  CHECK(of[0].front == of[1].front);
}
