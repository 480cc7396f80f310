// SPDX-License-Identifier: MIT
// Laws that hold whatever the material: conservation, free flight, rigid motion.
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::conservation {
namespace {

SolverSetup weightless(double dx) {
  SolverSetup setup;
  setup.dx = dx;
  setup.gravity = Vec3::Zero();
  return setup;
}

void spin(PlacedSnow& snow, const Vec3& center, const Vec3& omega) {
  for (std::size_t i = 0; i < snow.position.size(); ++i)
    snow.velocity[i] += omega.cross(snow.position[i] - center);
}

}  // namespace

TEST_CASE("a free body keeps its mass, momentum and angular momentum over 1000 steps", "[physics][figure]") {
  SolverSetup setup = weightless(0.01);
  const Vec3 center(0.3, 0.2, -0.1);
  setup.snow.push_back(ball(center, 0.06, setup.dx, elastic(), Vec3(0.5, 0.2, -0.3)));
  spin(setup.snow[0], center, Vec3(3, -8, 5));
  // A stir on top of the spin, so that the body is strained and rings.
  for (std::size_t i = 0; i < setup.snow[0].position.size(); ++i) {
    setup.snow[0].velocity[i].x() += 0.3 * std::sin(60 * setup.snow[0].position[i].y());
  }
  setup.check_energy_bound = false;
  Solver simulation(best_kernels(), setup);
  const Metrics before = simulation.metrics();
  Curve curve("free_body", "series,step,momentum,angular_momentum");
  for (int i = 1; i <= 1000; ++i) {
    simulation.step(1e-4);
    if (i % 20 != 0) continue;
    const Metrics now = simulation.metrics();
    curve.add("body",
              {double(i), (vec(now.momentum) - vec(before.momentum)).norm() / vec(before.momentum).norm(),
               (vec(now.angular_momentum) - vec(before.angular_momentum)).norm() /
                   vec(before.angular_momentum).norm()});
  }
  const Metrics after = simulation.metrics();
  CHECK(after.mass == before.mass);
  CHECK((vec(after.momentum) - vec(before.momentum)).norm() < 1e-5 * vec(before.momentum).norm());
  CHECK((vec(after.angular_momentum) - vec(before.angular_momentum)).norm() <
        1e-4 * vec(before.angular_momentum).norm());
  CHECK(after.elastic_energy > 0);
}

TEST_CASE("a body in free fall moves by -g dt^2 n (n + 1) / 2 in n steps", "[physics][figure]") {
  SolverSetup setup;
  setup.dx = 0.01;
  setup.gravity = Vec3(0, -9.81, 0);
  setup.snow.push_back(ball(Vec3(0.003, 50, 0.001), 0.03, setup.dx, Material{}, Vec3::Zero()));
  Solver simulation(best_kernels(), setup);
  const double before = simulation.metrics().potential_energy / (9.81 * simulation.metrics().mass);
  const double dt = 3e-4;
  const int n = 1000;
  Curve curve("free_fall", "series,time_s,fallen_m,expected_m");
  for (int i = 0; i < n; ++i) {
    if (i % 25 == 0) {
      const Metrics now = simulation.metrics();
      curve.add("ball", {now.time, before - now.potential_energy / (9.81 * now.mass),
                         9.81 * dt * dt * i * (i + 1) / 2});
    }
    simulation.step(dt);
  }
  const Metrics m = simulation.metrics();
  const double fallen = before - m.potential_energy / (9.81 * m.mass);
  CHECK(fallen == Approx(9.81 * dt * dt * n * (n + 1) / 2).epsilon(1e-4));
  CHECK(vec(m.momentum).y() / m.mass == Approx(-9.81 * n * dt).epsilon(1e-4));
  CHECK(m.elastic_energy < 1e-6 * m.kinetic_energy);
}

TEST_CASE("snow that drifts at 1 mm/s, 100 m from the origin, moves as it should", "[physics]") {
  for (const double dx : {0.01, 0.05}) {
    SolverSetup setup = weightless(dx);
    setup.snow.push_back(ball(Vec3(100, 80, -100), 4 * dx, dx, Material{}, Vec3(1e-3, 0, -1e-3)));
    Solver simulation(best_kernels(), setup);
    const Bounds before = bounds_of(simulation.metrics());
    for (int i = 0; i < 2000; ++i) simulation.step(1e-4);
    const Bounds after = bounds_of(simulation.metrics());
    const double expected = 2000 * 1e-4 * 1e-3;
    INFO("dx " << dx);
    CHECK((after.min - before.min - Vec3(expected, 0, -expected)).norm() < 0.002 * expected);
    CHECK((after.max - before.max - Vec3(expected, 0, -expected)).norm() < 0.002 * expected);
  }
}

TEST_CASE("a rigidly rotating body keeps its kinetic energy to 1 % over a turn", "[physics][figure]") {
  Curve curve("rotation", "series,turns,energy"), finer("finer_rotation", "series,cells,error,allowed");
  const auto kept = [&](int cells, const char* series) {  // in its radius; what is left of the energy
    SolverSetup setup = weightless(0.08 / cells);
    setup.snow.push_back(ball(Vec3::Zero(), 0.08, setup.dx, elastic(), Vec3::Zero()));
    spin(setup.snow[0], Vec3::Zero(), Vec3(0, 0, 10));
    Solver simulation(best_kernels(), setup);
    simulation.advance_to(0.05);  // the body first takes the strain of its spin
    const double before = simulation.metrics().kinetic_energy;
    for (int k = 1; k <= 40; ++k) {
      simulation.advance_to(0.05 + 2 * M_PI / 10 * k / 40);
      if (series) curve.add(series, {k / 40., simulation.metrics().kinetic_energy / before});
    }
    return simulation.metrics().kinetic_energy / before;
  };
  CHECK(kept(8, "ball") == Approx(1).epsilon(0.01));
  if (!makes_figures()) return;
  for (const int cells : {4, 8, 16})
    finer.add("energy of a turn", {double(cells), std::abs(kept(cells, nullptr) - 1), 0.01});
}

TEST_CASE("two colliding balls of snow keep their total momentum, lose energy and are packed", "[physics]") {
  SolverSetup setup = weightless(0.01);
  setup.snow.push_back(ball(Vec3(-0.06, 0, 0), 0.05, setup.dx, Material{}, Vec3(5, 1, 0)));
  setup.snow.push_back(ball(Vec3(0.06, 0.02, 0), 0.05, setup.dx, Material{}, Vec3(-5, 0, 0.5)));
  Solver simulation(best_kernels(), setup);
  const Metrics before = simulation.metrics();
  const double momentum_scale = before.mass * 5;
  Snapshot snapshot;
  float densest = 0;
  for (int frame = 1; frame <= 5; ++frame) {
    REQUIRE(simulation.advance_to(0.003 * frame));
    simulation.snapshot(snapshot);
    for (const float density : snapshot.density) densest = std::max(densest, density);
  }
  const Metrics after = simulation.metrics();
  CHECK((vec(after.momentum) - vec(before.momentum)).norm() < 1e-5 * momentum_scale);
  CHECK((vec(after.angular_momentum) - vec(before.angular_momentum)).norm() < 1e-4 * momentum_scale * 0.06);
  CHECK(after.kinetic_energy + after.elastic_energy < 0.9 * before.kinetic_energy);
  CHECK(densest > 480);
}

}  // namespace firn::test::conservation
