// SPDX-License-Identifier: MIT
// Contact with colliders: Coulomb friction on an incline, rest on the ground, sticking, the domain's
// boundary.
#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::contact {
namespace {

constexpr double kDx = 0.02;

// A flat elastic block on level ground with gravity tilted by `degrees`: an incline without lattice steps.
// The ground lies on a row of nodes.
SolverSetup incline(double degrees, double friction, Contact contact, double dx = kDx) {
  SolverSetup setup;
  setup.dx = dx;
  const double angle = degrees * M_PI / 180;
  setup.gravity = 9.81 * Vec3(std::sin(angle), -std::cos(angle), 0);
  Material material = elastic();
  material.young_modulus = 1e6;
  setup.snow.push_back(
      fill(Vec3(0, 0.5 * dx, 0), Vec3(12 * kDx, 4 * kDx + 0.5 * dx, 8 * kDx), dx, 2, material));
  setup.colliders.push_back(plane(Vec3(0, 0.5 * dx, 0), Vec3(0, 1, 0), contact, friction));
  return setup;
}

double speed_along(const Solver& simulation) {
  const Metrics m = simulation.metrics();
  return vec(m.momentum).x() / m.mass;
}

// m/s^2, from 0.1 s, when the weight has settled on the ground, to 0.4 s. see(time, speed gained) on the way.
double acceleration_of(Solver& simulation, const std::function<void(double, double)>& see = {}) {
  simulation.advance_to(0.1);
  const double start = speed_along(simulation);
  for (int k = 1; k <= 12; ++k) {
    simulation.advance_to(0.1 + 0.025 * k);
    if (see) see(simulation.time(), speed_along(simulation) - start);
  }
  return (speed_along(simulation) - start) / 0.3;
}

}  // namespace

TEST_CASE("a block on an incline slides at g (sin - mu cos) when tan exceeds mu", "[physics][figure]") {
  Curve finer("finer_incline", "series,cells,error,allowed");
  for (const double degrees : {20.0, 35.0}) {
    const double mu = 0.2, angle = degrees * M_PI / 180;
    const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle));
    Solver simulation(best_kernels(), incline(degrees, mu, Contact::separating));
    INFO(degrees);
    CHECK(acceleration_of(simulation) == Approx(expected).epsilon(0.02));
    if (!makes_figures()) continue;
    for (const int cells : {2, 4, 8, 16}) {  // in the block's height
      Solver sized(best_kernels(), incline(degrees, mu, Contact::separating, 4 * kDx / cells));
      finer.add("block on " + std::to_string(std::lround(degrees)) + " degrees",
                {double(cells), std::abs(acceleration_of(sized) / expected - 1), 0.02});
    }
  }
}

TEST_CASE("a block on 20 degrees gains g (sin - mu cos), and nothing when mu exceeds tan",
          "[physics][figure]") {
  const double angle = 20 * M_PI / 180, settled = 0.1;
  Curve curve("incline", "series,time_s,speed_m_s,expected_m_s");
  for (const double mu : {0.0, 0.1, 0.2, 0.3, 0.5}) {
    SolverSetup setup = incline(20, mu, Contact::separating);
    setup.sleep = false;
    Solver simulation(best_kernels(), setup);
    simulation.advance_to(settled);
    const double start = speed_along(simulation);
    const double acceleration = std::max(0.0, 9.81 * (std::sin(angle) - mu * std::cos(angle)));
    INFO("mu " << mu << ": " << acceleration << " m/s^2");
    for (int k = 0; k <= 16; ++k) {
      const double time = settled + 0.025 * k;
      simulation.advance_to(time);
      const double gained = speed_along(simulation) - start;
      curve.add("mu = " + std::to_string(mu).substr(0, 3), {time, gained, acceleration * (time - settled)});
    }
    CHECK(speed_along(simulation) - start == Approx(acceleration * 0.4).epsilon(0.02).margin(2e-3));
  }
}

TEST_CASE("a block on an incline stays when mu exceeds tan", "[physics]") {
  Solver simulation(best_kernels(), incline(20, 0.6, Contact::separating));
  simulation.advance_to(0.2);
  const Vec3 before = bounds_of(simulation.metrics()).center();
  simulation.advance_to(0.5);
  CHECK(std::abs(speed_along(simulation)) < 0.01);
  CHECK((bounds_of(simulation.metrics()).center() - before).norm() < 0.1 * kDx);
}

TEST_CASE("between the two friction angles a block at rest stays, and one that moves goes on sliding",
          "[physics][figure]") {
  Curve curve("two_frictions", "series,time_s,speed_m_s,expected_m_s");
  const double mu_static = 0.6, mu_dynamic = 0.2, angle = 20 * M_PI / 180;  // tan is 0.364
  SolverSetup held = incline(20, mu_static, Contact::separating);
  held.sleep = false;
  Solver settling(best_kernels(), held);
  settling.advance_to(1.0);  // the ringing of the sudden weight dies away
  std::stringstream saved;
  settling.save(saved);

  SolverSetup setup = incline(20, mu_dynamic, Contact::separating);
  setup.sleep = false;
  setup.colliders[0].static_friction = mu_static;
  Solver resting(best_kernels(), setup);
  resting.load(saved);
  const Vec3 before = bounds_of(resting.metrics()).center();
  for (int k = 1; k <= 24; ++k) {
    resting.advance_to(1 + 0.025 * k);
    curve.add("at rest", {0.025 * k, speed_along(resting), 0});
  }
  CHECK(std::abs(speed_along(resting)) < 1e-4);
  CHECK((bounds_of(resting.metrics()).center() - before).norm() < 0.01 * kDx);

  for (Vec3& v : setup.snow[0].velocity) v = Vec3(0.5, 0, 0);
  Solver sliding(best_kernels(), setup);
  const double expected = 9.81 * (std::sin(angle) - mu_dynamic * std::cos(angle));
  const double acceleration = acceleration_of(sliding, [&](double time, double gained) {
    curve.add("sliding", {time - 0.1, gained, expected * (time - 0.1)});
  });
  CHECK(acceleration == Approx(expected).epsilon(0.02));
}

TEST_CASE("without friction a block slides at g sin, on slip and on separating ground alike", "[physics]") {
  for (const Contact contact : {Contact::slip, Contact::separating}) {
    Solver simulation(best_kernels(), incline(10, 0, contact));
    simulation.advance_to(0.2);
    CHECK(speed_along(simulation) == Approx(9.81 * std::sin(10 * M_PI / 180) * 0.2).epsilon(0.005));
  }
}

TEST_CASE("sticky ground holds a block by its foot and separating ground lets it go", "[physics]") {
  for (const Contact contact : {Contact::sticky, Contact::slip, Contact::separating}) {
    SolverSetup setup = incline(0, 0, contact);
    setup.gravity = Vec3::Zero();
    for (Vec3& v : setup.snow[0].velocity) v = Vec3(0, 0.5, 0);
    Solver simulation(best_kernels(), setup);
    simulation.advance_to(0.2);
    const double lift = bounds_of(simulation.metrics()).min.y() - kDx * 0.75;
    INFO(static_cast<int>(contact));
    if (contact == Contact::separating) {
      CHECK(lift == Approx(0.1).epsilon(0.02));
    } else {
      CHECK(lift < kDx);
    }
  }
}

TEST_CASE("snow that falls on the ground comes to rest above it", "[physics]") {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(ball(Vec3(0, 0.25, 0), 0.1, kDx, Material{}, Vec3(0, -2, 0)));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0, 1, 0), Contact::separating, 0.5));
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(1.0);
  const Metrics m = simulation.metrics();
  CHECK(bounds_of(m).min.y() > -kDx);
  CHECK(m.kinetic_energy < 1e-2 * m.mass);
  CHECK(m.particles_left == 0);
}

TEST_CASE("snow rolls off a ball and off a box corner without getting inside", "[physics]") {
  for (const bool round : {true, false}) {
    SolverSetup setup;
    setup.dx = kDx;
    setup.snow.push_back(ball(Vec3(0.03, 0.3, 0.02), 0.08, kDx, Material{}, Vec3(0, -3, 0)));
    Collider collider;
    if (round) {
      collider.shape.form = Ball{0.15};
    } else {
      collider.shape.form = Box{Vec3::Constant(0.12)};
    }
    setup.colliders.push_back(collider);
    Solver simulation(best_kernels(), setup);
    simulation.advance_to(0.3);
    Snapshot snapshot;
    simulation.snapshot(snapshot);
    double deepest = 0;
    for (std::size_t i = 0; i < snapshot.size(); ++i) {
      deepest = std::min(deepest, signed_distance(collider.shape, vec(snapshot.world_position(i))));
    }
    INFO((round ? "ball" : "box"));
    CHECK(deepest > -1.0 * kDx);
  }
}

TEST_CASE("particles that leave the domain are removed and counted, and nothing hangs outside", "[physics]") {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(ball(Vec3(-0.2, 0, 0), 0.08, kDx, Material{}, Vec3(2, 0, 0)));
  setup.snow.push_back(ball(Vec3(0.2, 0.1, 0), 0.08, kDx, Material{}, Vec3::Zero()));
  setup.gravity = Vec3(0, -9.81, 0);
  setup.domain = Shape{Box{Vec3(0.5, 0.5, 0.5)}, Pose{}};
  Solver simulation(best_kernels(), setup);
  const std::size_t placed = simulation.particle_count();
  const double mass = simulation.metrics().mass;
  simulation.advance_to(0.35);
  const Metrics m = simulation.metrics();
  CHECK(m.particles_left > 0);
  CHECK(m.particles + m.particles_left == placed);
  CHECK(m.mass < mass);
  CHECK(bounds_of(m).min.y() > -0.5 - 6 * kDx);
  simulation.advance_to(1.5);
  CHECK(simulation.particle_count() == 0);
  CHECK(simulation.metrics().particles_left == placed);
}

}  // namespace firn::test::contact
