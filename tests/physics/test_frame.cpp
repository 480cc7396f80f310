// SPDX-License-Identifier: MIT
// A turned domain: the simulation steps in a frame of its own and tells the same in world coordinates.
#include <sstream>

#include "firn/error.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::frame {
namespace {

constexpr double kDx = 0.02;
constexpr double kTilt = 35 * M_PI / 180;
constexpr double kFriction = 0.2;

Mat3 down_right() { return Eigen::AngleAxisd(-kTilt, Vec3::UnitZ()).toRotationMatrix(); }

// Any pose at all: turned about three axes and shifted by no whole number of cells.
Pose anywhere() {
  const Eigen::Quaterniond turn =
      Eigen::AngleAxisd(0.4, Vec3::UnitX()) * Eigen::AngleAxisd(-0.9, Vec3::UnitY());
  return {down_right() * turn.toRotationMatrix(), Vec3(3.017, -1.234, 0.571)};
}

// An elastic block on a plane through a row of nodes, gravity aslant, in the coordinates of the slope.
SolverSetup slope_seen_along_it() {
  SolverSetup setup;
  setup.dx = kDx;
  setup.gravity = 9.81 * Vec3(std::sin(kTilt), -std::cos(kTilt), 0);
  Material material = elastic();
  material.young_modulus = 1e6;
  setup.snow.push_back(fill(Vec3(0, 0.5 * kDx, 0), Vec3(12 * kDx, 4.5 * kDx, 8 * kDx), kDx, 2, material));
  setup.colliders.push_back(plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::separating, kFriction));
  return setup;
}

// The same scene as it looks when `pose` carries it into the world.
SolverSetup carried(SolverSetup setup, const Pose& pose) {
  setup.gravity = pose.rotation * setup.gravity;
  for (PlacedSnow& snow : setup.snow) {
    for (Vec3& x : snow.position) x = pose.to_world(x);
    for (Vec3& v : snow.velocity) v = pose.rotation * v;
  }
  for (Collider& c : setup.colliders) {
    c.shape.pose = {pose.rotation * c.shape.pose.rotation, pose.to_world(c.shape.pose.translation)};
  }
  return setup;
}

SolverSetup in_frame_of(SolverSetup setup, const Pose& pose) {
  setup.frame = pose;
  return setup;
}

Vec3 mean_velocity(const Metrics& m) { return vec(m.momentum) / m.mass; }

}  // namespace

TEST_CASE("in a domain that follows the slope a block slides at g (sin - mu cos), straight down it",
          "[physics][figure]") {
  Curve curve("turned_domain", "series,time_s,speed_m_s,expected_m_s");
  const Pose pose{down_right(), Vec3(0.3, 1.7, -0.2)};
  const SolverSetup world = carried(slope_seen_along_it(), pose);
  CHECK((world.gravity - Vec3(0, -9.81, 0)).norm() < 1e-12);
  Solver simulation(best_kernels(), in_frame_of(world, pose));
  simulation.advance_to(0.1);
  const Vec3 start = mean_velocity(simulation.metrics());
  const Vec3 down = Vec3(std::cos(kTilt), -std::sin(kTilt), 0);
  const double expected = 9.81 * (std::sin(kTilt) - kFriction * std::cos(kTilt));
  for (int k = 1; k <= 12; ++k) {
    simulation.advance_to(0.1 + 0.025 * k);
    const double gained = (mean_velocity(simulation.metrics()) - start).dot(down);
    curve.add("turned by 35 degrees", {0.025 * k, gained, expected * 0.025 * k});
  }
  const Vec3 acceleration = (mean_velocity(simulation.metrics()) - start) / 0.3;
  CAPTURE(acceleration.dot(down), expected);
  CHECK((acceleration - expected * down).norm() < 0.02 * expected);
}

TEST_CASE(
    "metrics and snapshots of a turned domain are those of the slope seen along it, in world coordinates",
    "[physics]") {
  const Pose pose = anywhere();
  const SolverSetup local = slope_seen_along_it(), world = carried(local, pose);
  Solver along(best_kernels(), local), turned(best_kernels(), in_frame_of(world, pose));
  along.advance_to(0.2);
  turned.advance_to(0.2);
  const Metrics a = along.metrics(), b = turned.metrics();
  CHECK(b.steps == a.steps);
  CHECK((vec(b.momentum) - pose.rotation * vec(a.momentum)).norm() < 1e-4 * vec(a.momentum).norm());
  const Vec3 spin =
      pose.rotation * vec(a.angular_momentum) + pose.translation.cross(pose.rotation * vec(a.momentum));
  CHECK((vec(b.angular_momentum) - spin).norm() < 1e-4 * spin.norm());
  CHECK(b.kinetic_energy == Approx(a.kinetic_energy).epsilon(1e-3));
  const double shift = b.mass * world.gravity.dot(pose.translation);
  CHECK(b.potential_energy + shift == Approx(a.potential_energy).margin(1e-5 * std::abs(shift)));
  CHECK(b.front == Approx(a.front + front_direction(world).dot(pose.translation)).margin(1e-4));
  CHECK(b.max_speed == Approx(a.max_speed).epsilon(1e-3));
  REQUIRE(b.contacts.size() == a.contacts.size());
  const Vec3 force = pose.rotation * vec(a.contacts[0].force);
  CHECK(force.norm() > 1);
  CHECK((vec(b.contacts[0].force) - force).norm() < 1e-3 * force.norm());

  Snapshot seen, expected;
  along.snapshot(expected);
  turned.snapshot(seen);
  REQUIRE(seen.size() == expected.size());
  double apart = 0, faster = 0;
  Bounds bounds;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    REQUIRE(seen.id[i] == expected.id[i]);
    const Vec3 v(seen.velocity[0][i], seen.velocity[1][i], seen.velocity[2][i]);
    const Vec3 u(expected.velocity[0][i], expected.velocity[1][i], expected.velocity[2][i]);
    apart = std::max(apart,
                     (vec(seen.world_position(i)) - pose.to_world(vec(expected.world_position(i)))).norm());
    faster = std::max(faster, (v - pose.rotation * u).norm());
    bounds.include(vec(seen.world_position(i)));
  }
  CHECK(apart < 1e-3 * kDx);
  CHECK(faster < 2e-3);
  CHECK((bounds.min - bounds_of(b).min).norm() < 1e-5);
  CHECK((bounds.max - bounds_of(b).max).norm() < 1e-5);
}

TEST_CASE("a slab runs as far down a slope in a turned domain as on a tilted plane in the world's grid",
          "[physics]") {
  SolverSetup setup;
  setup.dx = kDx;
  setup.gravity = 9.81 * Vec3(std::sin(kTilt), -std::cos(kTilt), 0);
  setup.colliders.push_back(plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::separating, kFriction));
  Material soft;  // breaks and spreads as it slides
  soft.density = 250;
  setup.snow.push_back(fill(Vec3(0, 0.5 * kDx, 0), Vec3(0.4, 0.5 * kDx + 0.1, 0.2), kDx, 2, soft));
  const Pose pose{down_right(), Vec3(0.1, 0.2, 0.3)};
  const SolverSetup world = carried(setup, pose);
  double way[2];
  for (const bool turned : {false, true}) {
    Solver simulation(best_kernels(), turned ? in_frame_of(world, pose) : world);
    const double start = simulation.metrics().front;
    simulation.advance_to(0.6);
    way[turned] = simulation.metrics().front - start;
  }
  CAPTURE(way[0], way[1]);
  CHECK(way[1] > 0.4);
  CHECK(way[1] == Approx(way[0]).epsilon(0.05));
}

TEST_CASE("colliders that move, and the domain's boundary, stand in a turned domain where the scene says",
          "[physics]") {
  const Pose pose = anywhere();
  SolverSetup setup;  // a wall sweeps a ball along +x, out of the domain
  setup.dx = kDx;
  setup.gravity = Vec3::Zero();
  setup.snow.push_back(ball(Vec3(0.15, 0, 0), 0.08, kDx, Material{}, Vec3::Zero()));
  Collider wall;
  wall.name = "wall";
  wall.shape.form = Box{Vec3(0.04, 0.2, 0.2)};
  wall.motion =
      Motion({{0, Vec3::Zero(), Mat3::Identity()}, {0.2, Vec3(0.4, 0, 0), Mat3::Identity()}}, Vec3::Zero());
  setup.colliders.push_back(wall);
  setup.domain = Shape{Box{Vec3(0.4, 0.5, 0.5)}, Pose{}};
  Solver plain(best_kernels(), setup);
  setup.frame = pose;
  Solver simulation(best_kernels(), setup);
  const std::size_t placed = simulation.particle_count();
  plain.advance_to(0.1);
  simulation.advance_to(0.1);
  Metrics m = simulation.metrics();
  CHECK(m.particles_left == 0);
  CHECK(bounds_of(m).min.x() > 0.04 + 0.2 - 0.5 * kDx);
  CHECK(bounds_of(m).min.x() == Approx(bounds_of(plain.metrics()).min.x()).margin(kDx));
  CHECK(mean_velocity(m).x() == Approx(2).epsilon(0.2));
  CHECK(std::abs(mean_velocity(m).y()) < 0.05);

  std::stringstream saved;
  simulation.save(saved);
  Solver resumed(best_kernels(), setup);
  resumed.load(saved);
  simulation.advance_to(0.3);
  resumed.advance_to(0.3);
  CHECK(resumed.state_hash() == simulation.state_hash());
  m = simulation.metrics();
  CHECK(m.particles_left > placed / 4);
  CHECK((m.particles == 0 || bounds_of(m).max.x() < 0.4 + 6 * kDx));

  std::stringstream again;
  resumed.save(again);
  SolverSetup elsewhere = setup;
  elsewhere.frame->translation.x() += kDx;
  CHECK_THROWS_AS(Solver(best_kernels(), elsewhere).load(again), Error);
}

}  // namespace firn::test::frame
