// SPDX-License-Identifier: MIT
// Colliders thinner than the grid can tell: no particle goes through them, at rest or moving.
#include <sstream>

#include "src/mpm/thin_colliders.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::thin {
namespace {

constexpr double kDx = 0.02;

Collider plate(const Vec3& center, const Vec3& size, const Mat3& rotation = Mat3::Identity()) {
  Collider c;
  c.name = "plate";
  c.shape = {Box{0.5 * size}, {rotation, center}};
  c.friction = 0.2;
  return c;
}

// A ball thrown down onto a plate that is wider than what it bursts to.
SolverSetup thrown_at(const Collider& collider, double speed) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(ball(Vec3(0.003, 0.11, 0.002), 0.08, kDx, Material{}, Vec3(0, -speed, 0)));
  setup.colliders.push_back(collider);
  return setup;
}

// How far the snow got through the plane of the plate, m along its normal; below 0: not at all.
double through(const Solver& simulation, const Shape& shape, const Vec3& normal) {
  Snapshot s;
  simulation.snapshot(s);
  double most = -1;
  for (std::size_t i = 0; i < s.size(); ++i)
    most = std::max(most, -normal.dot(vec(s.world_position(i)) - shape.pose.translation));
  return most;
}

}  // namespace

TEST_CASE("fast snow does not go through a plate of a tenth of a cell, wherever it lies among the nodes",
          "[physics][figure]") {
  Curve curve("thin_plates", "series,time_s,cells_above");
  for (const double thick : {0.1, 0.9}) {
    for (const double shift : {0.0, 0.3, 0.5, 0.77}) {
      for (const double tilt : {0.0, 0.4}) {
        const Mat3 turn = Eigen::AngleAxisd(tilt, Vec3::UnitZ()).toRotationMatrix();
        const Collider collider = plate(Vec3(0, shift * kDx, 0), Vec3(2, thick * kDx, 2), turn);
        Solver simulation(best_kernels(), thrown_at(collider, 20));
        INFO("thickness " << thick << ", at " << shift << ", tilted by " << tilt);
        for (int frame = 1; frame <= 8; ++frame) {
          simulation.advance_to(0.01 * frame);
          const double gone = through(simulation, collider.shape, turn.col(1));
          REQUIRE(gone < 0);
          std::ostringstream plate_name;
          plate_name << thick << " cells thick " << (tilt > 0 ? "(tilted)" : "(level)");
          if (shift == 0.3) curve.add(plate_name.str(), {simulation.time(), -gone / kDx});
        }
        CHECK(vec(simulation.metrics().momentum).y() >
              -0.2 * simulation.metrics().mass * 20);  // it was stopped
      }
    }
  }
}

TEST_CASE("what a thin plate takes from the snow is in its force", "[physics]") {
  SolverSetup setup = thrown_at(plate(Vec3(0, 0.3 * kDx, 0), Vec3(2, 0.1 * kDx, 2)), 8);
  Solver simulation(best_kernels(), setup);
  const Metrics start = simulation.metrics();
  simulation.advance_to(0.02);
  const Metrics end = simulation.metrics();
  const Vec3 given = vec(end.momentum) - vec(start.momentum) - 0.02 * end.mass * setup.gravity;
  CHECK(given.y() > 0.5 * start.mass * 8);
  CHECK((0.02 * vec(end.contacts.at(0).force) - given).norm() < 1e-3 * given.norm());
}

TEST_CASE("a thin blade sweeps a channel clean: nothing goes through it", "[physics][figure]") {
  Curve curve("thin_blade", "series,time_s,cells_above");
  SolverSetup setup;
  setup.dx = kDx;
  setup.colliders.push_back(plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::separating, 0.2));
  setup.colliders.push_back(plane(Vec3(0, 0, -3.5 * kDx), Vec3(0, 0, 1), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 3.5 * kDx), Vec3(0, 0, -1), Contact::slip, 0));
  setup.snow.push_back(fill(Vec3(0, 0.5 * kDx, -3.5 * kDx), Vec3(20, 6.5, 3.5) * kDx, kDx, 2, Material{}));
  Collider blade = plate(Vec3(-1.3 * kDx, 0.2, 0), Vec3(0.2 * kDx, 1, 1));
  blade.motion = Motion({{0, Vec3::Zero(), Mat3::Identity()}, {0.1, Vec3(0.3, 0, 0), Mat3::Identity()}},
                        blade.shape.pose.translation);
  setup.colliders.push_back(blade);
  Solver simulation(best_kernels(), setup);
  for (int frame = 1; frame <= 10; ++frame) {
    simulation.advance_to(0.01 * frame);
    const Shape now{blade.shape.form, blade.motion.pose(blade.shape.pose, simulation.time())};
    const double gone = through(simulation, now, Vec3(1, 0, 0));
    REQUIRE(gone < 0);
    curve.add("blade of 0.2 cells", {simulation.time(), -gone / kDx});
  }
  CHECK(vec(simulation.metrics().momentum).x() > 0.3 * simulation.metrics().mass);
}

TEST_CASE("with thin colliders the bits are the same for any number of threads on v3 and v4", "[physics]") {
  std::uint64_t expected = 0;
  with_kernels_and_threads({1, 3}, [&](const kernels::KernelTable& table) {
    Solver simulation(table, thrown_at(plate(Vec3(0, 0.3 * kDx, 0), Vec3(2, 0.1 * kDx, 2)), 8));
    simulation.advance_to(0.03);
    if (expected == 0) expected = simulation.state_hash();
    CHECK(simulation.state_hash() == expected);
  });
}

TEST_CASE("thickness is across the thinnest part", "[physics]") {
  CHECK(thickness({Box{Vec3(1, 0.01, 2)}, {}}) == Approx(0.02));
  CHECK(thickness({Ball{0.3}, {}}) == Approx(0.6));
  CHECK(thickness({Capsule{0.1, 1}, {}}) == Approx(0.2));
  CHECK(thickness({Cylinder{0.3, 0.05}, {}}) == Approx(0.1));
  CHECK(thickness({HalfSpace{}, {}}) > 1e299);
}

}  // namespace firn::test::thin
