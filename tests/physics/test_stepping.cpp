// SPDX-License-Identifier: MIT
// The step itself: its length and why, sorting at the speed limit, blow-ups that stop with a reason, memory.
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "firn/error.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::stepping {
namespace {

SolverSetup one_ball(double dx, const Vec3& velocity) {
  SolverSetup setup;
  setup.dx = dx;
  setup.snow.push_back(ball(Vec3(0.001, 0.002, 0.003), 5 * dx, dx, Material{}, velocity));
  return setup;
}

std::string message_of(const std::function<void()>& action, ErrorCode code) {
  try {
    action();
  } catch (const Error& error) {
    CHECK(error.code() == code);
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("particles at the velocity limit cross block after block and keep their places to round-off",
          "[physics]") {
  SolverSetup setup = one_ball(0.01, Vec3(40, 36, -33));
  setup.gravity = Vec3::Zero();
  Solver simulation(best_kernels(), setup);
  Snapshot before, after;
  simulation.snapshot(before);
  const double dt = simulation.stable_step().dt;
  CHECK(contains(simulation.stable_step().cause, "particle speed"));
  const int steps = 200;
  for (int i = 0; i < steps; ++i) simulation.step(dt);
  simulation.snapshot(after);
  REQUIRE(after.size() == before.size());
  std::vector<Vec3> start(before.size());
  for (std::size_t i = 0; i < before.size(); ++i) start[before.id[i]] = vec(before.world_position(i));
  double worst = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const Vec3 expected = start[after.id[i]] + steps * dt * Vec3(40, 36, -33);
    worst = std::max(worst, (vec(after.world_position(i)) - expected).norm());
  }
  CHECK(worst < 1e-3 * setup.dx);
}

TEST_CASE("the step adapts to packed snow and says so", "[physics]") {
  SolverSetup setup = one_ball(0.01, Vec3(0, -8, 0));
  setup.colliders.push_back(plane(Vec3(0, -0.06, 0), Vec3(0, 1, 0), Contact::sticky, 0));
  Solver simulation(best_kernels(), setup);
  const TimeStep fresh = simulation.stable_step();
  CHECK(fresh.dt == Approx(kElasticCourant * 0.01 / 19.72).epsilon(1e-3));
  CHECK(contains(fresh.cause, "fresh snow, 19.7 m/s"));
  simulation.advance_to(0.02);
  const TimeStep packed = simulation.stable_step();
  CHECK(packed.dt < 0.5 * fresh.dt);
  CHECK(contains(packed.cause, "packed snow"));
}

TEST_CASE("advancing ends at the very time asked for, with steps of one length", "[physics]") {
  Solver simulation(best_kernels(), one_ball(0.01, Vec3::Zero()));
  const double limit = simulation.stable_step().dt;
  const double frame = 10.3 * limit;
  simulation.advance_to(frame);
  CHECK(simulation.time() == frame);
  CHECK(simulation.metrics().steps == 11);
  CHECK(simulation.metrics().step.dt == Approx(frame / 11).epsilon(1e-9));
}

TEST_CASE("a fixed dt is kept and divides the frame", "[physics]") {
  SolverSetup setup = one_ball(0.01, Vec3::Zero());
  setup.fixed_dt = 1e-4;
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.01);
  CHECK(simulation.metrics().steps == 100);
  CHECK(contains(simulation.stable_step().cause, "fixed"));
}

TEST_CASE("a fixed dt that is far too long stops with step, particle and cause", "[physics]") {
  SolverSetup setup = one_ball(0.01, Vec3(0, -5, 0));
  setup.colliders.push_back(plane(Vec3(0, -0.06, 0), Vec3(0, 1, 0), Contact::separating, 0.3));
  setup.fixed_dt = 1.2e-3;
  const std::string message = message_of(
      [&] {
        Solver simulation(best_kernels(), setup);
        simulation.advance_to(1);
      },
      ErrorCode::unstable);
  INFO(message);
  CHECK(contains(message, "step"));
  CHECK(contains(message, "particle"));
  CHECK(contains(message, "fixed dt of 0.0012 s"));
}

TEST_CASE("the adaptive step keeps a hard impact stable and within the scene's energy", "[physics]") {
  SolverSetup setup = one_ball(0.01, Vec3(0, -30, 0));
  setup.colliders.push_back(plane(Vec3(0, -0.06, 0), Vec3(0, 1, 0), Contact::separating, 0.3));
  Solver simulation(best_kernels(), setup);
  const Metrics before = simulation.metrics();
  CHECK_NOTHROW(simulation.advance_to(0.02));
  const Metrics after = simulation.metrics();
  const double gravity_gain = before.potential_energy - after.potential_energy;
  CHECK(after.kinetic_energy + after.elastic_energy < before.kinetic_energy + gravity_gain);
}

TEST_CASE("no snow, places that are not numbers and places beyond the grid are usage errors", "[physics]") {
  SolverSetup empty;
  CHECK(contains(message_of([&] { Solver s(best_kernels(), empty); }, ErrorCode::usage), "no snow"));
  SolverSetup nan = one_ball(0.01, Vec3::Zero());
  nan.snow[0].position[3].y() = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(message_of([&] { Solver s(best_kernels(), nan); }, ErrorCode::usage), "not finite"));
  SolverSetup far = one_ball(0.01, Vec3::Zero());
  far.snow[0].position[3].x() = 2e4;
  CHECK(contains(message_of([&] { Solver s(best_kernels(), far); }, ErrorCode::usage), "from the origin"));
}

TEST_CASE("the grid grows and shrinks with the snow", "[physics]") {
  SolverSetup setup = one_ball(0.01, Vec3::Zero());
  setup.gravity = Vec3::Zero();
  setup.snow.push_back(ball(Vec3(50, 0, 0), 0.05, 0.01, Material{}, Vec3::Zero()));
  Solver near(best_kernels(), one_ball(0.01, Vec3::Zero())), far(best_kernels(), setup);
  CHECK(far.grid_blocks() < 3 * near.grid_blocks());  // 50 m of air cost nothing
}

TEST_CASE("compact snow takes 120 to 300 bytes a particle, the grid included", "[physics]") {
  for (const double radius : {0.08, 0.2}) {
    SolverSetup setup;
    setup.dx = 0.01;
    setup.snow.push_back(ball(Vec3::Zero(), radius, setup.dx, Material{}, Vec3(3, 0, 0)));
    Solver simulation(best_kernels(), setup);
    for (int i = 0; i < 40; ++i) simulation.step(1e-4);  // sorted at least once
    const double each =
        static_cast<double>(simulation.resident_bytes()) / static_cast<double>(simulation.particle_count());
    INFO(radius << " " << each);
    CHECK(each > 120);
    CHECK(each < (radius > 0.1 ? 220 : 300));  // the rim of small bodies is a larger part of them
  }
}

}  // namespace firn::test::stepping
