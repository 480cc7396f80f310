// SPDX-License-Identifier: MIT
// Drag of still air: snow with a terminal velocity falls as flakes do.
#include <sstream>

#include "firn/error.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::drag {
namespace {

constexpr double kDx = 0.012;

Material flaky() {
  Material m;
  m.density = 80;
  m.young_modulus = 6e3;
  return m;
}

PlacedSnow flake(const Vec3& center, std::optional<double> terminal_velocity,
                 const Vec3& velocity = Vec3::Zero()) {
  PlacedSnow snow = ball(center, 0.014, kDx, flaky(), velocity);
  snow.terminal_velocity = terminal_velocity;
  return snow;
}

SolverSetup in_the_air(PlacedSnow snow) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(std::move(snow));
  return setup;
}

Vec3 mean_velocity(const Metrics& m) { return vec(m.momentum) / m.mass; }

}  // namespace

TEST_CASE("a flake that falls from rest gains v_t tanh(g t / v_t) and ends at v_t", "[physics][figure]") {
  Curve curve("drag", "series,time,speed,expected");
  for (const double terminal : {0.25, 1.0, 4.0}) {
    Solver simulation(best_kernels(), in_the_air(flake(Vec3::Zero(), terminal)));
    const double start = bounds_of(simulation.metrics()).center().y();
    for (const double share : {0.1, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {  // of the time v_t / g
      simulation.advance_to(share * terminal / 9.81);
      curve.add(std::to_string(terminal).substr(0, 4) + " m/s",
                {share, -mean_velocity(simulation.metrics()).y() / terminal, std::tanh(share)});
      INFO(terminal << " m/s, " << share);
      CHECK(mean_velocity(simulation.metrics()).y() == Approx(-terminal * std::tanh(share)).epsilon(0.01));
    }
    const Bounds bounds = bounds_of(simulation.metrics());  // the way is v_t^2/g ln cosh
    CHECK(bounds.center().y() - start ==
          Approx(-terminal * terminal / 9.81 * std::log(std::cosh(6.0))).epsilon(0.01));
  }
}

TEST_CASE("a flake thrown down or aside ends at its terminal velocity, straight down", "[physics]") {
  for (const Vec3& thrown : {Vec3(0, -5, 0), Vec3(4, 3, -2)}) {
    Solver simulation(best_kernels(), in_the_air(flake(Vec3::Zero(), 1.0, thrown)));
    simulation.advance_to(1.0);
    CHECK((mean_velocity(simulation.metrics()) - Vec3(0, -1, 0)).norm() < 0.01);
  }
}

TEST_CASE("each snow object has its own terminal velocity, and one without falls as in a vacuum",
          "[physics]") {
  SolverSetup setup = in_the_air(flake(Vec3(0, 0, 0), 1.0));
  setup.snow.push_back(flake(Vec3(0.5, 0, 0), std::nullopt));
  setup.snow.push_back(flake(Vec3(1.0, 0, 0), 2.0));
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.4);
  Snapshot snapshot;
  simulation.snapshot(snapshot);
  const double expected[] = {-std::tanh(0.4 * 9.81), -0.4 * 9.81, -2 * std::tanh(0.4 * 9.81 / 2)};
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    CHECK(snapshot.velocity[1][i] == Approx(expected[snapshot.object[i]]).epsilon(0.01));
  }
}

TEST_CASE("a saved state does not load into a scene with another terminal velocity", "[physics]") {
  Solver simulation(best_kernels(), in_the_air(flake(Vec3::Zero(), 1.0)));
  std::stringstream saved;
  simulation.save(saved);
  CHECK_THROWS_AS(Solver(best_kernels(), in_the_air(flake(Vec3::Zero(), 2.0))).load(saved), Error);
}

TEST_CASE("with air, in a turned domain, the bits are the same for 1 and 3 threads on x86-64-v3 and v4",
          "[physics]") {
  SolverSetup setup = in_the_air(flake(Vec3(0, 0.06, 0), 1.0, Vec3(0, -3, 0)));
  setup.snow.push_back(flake(Vec3(0.01, 0.1, 0.01), 3.0, Vec3(0, -4, 0)));  // overtakes the first
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0.2, 1, 0), Contact::separating, 0.3));
  setup.frame =
      Pose{Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix(), Vec3(0.1, 0.2, 0.3)};
  std::uint64_t expected = 0;
  with_kernels_and_threads({1, 3}, [&](const kernels::KernelTable& table) {
    Solver simulation(table, setup);
    simulation.advance_to(0.1);
    if (expected == 0) expected = simulation.state_hash();
    CHECK(simulation.state_hash() == expected);
  });
}

}  // namespace firn::test::drag
