// SPDX-License-Identifier: MIT
// Snow that has come to rest sleeps, wakes when something moves beside it, and neither shows in where the
// snow goes.

#include <cmath>
#include <sstream>
#include <vector>

#include "firn/error.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::sleep {
namespace {

constexpr double kDx = 0.02;

SolverSetup on_ground(bool sleep) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.sleep = sleep;
  setup.colliders.push_back(plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::separating, 0.5));
  return setup;
}

// 16 x 5 x 16 cells of snow that fall 3 1/2 cells and pack a little, so that they rest after about 0.4 s
// (snow that never yielded would ring for long).
PlacedSnow bed() {
  return fill(Vec3(-8 * kDx, 4 * kDx, -8 * kDx), Vec3(8 * kDx, 9 * kDx, 8 * kDx), kDx, 2, Material{});
}

// The ball reaches the bed at 0.6 s.
SolverSetup bed_and_ball(bool sleep) {
  SolverSetup setup = on_ground(sleep);
  setup.snow.push_back(bed());
  setup.snow.push_back(ball(Vec3(-2 * kDx, 2.05, 0), 3 * kDx, kDx, Material{}, Vec3::Zero()));
  return setup;
}

Vec3 center_of(const Solver& simulation, std::uint16_t object) {
  Snapshot snapshot;
  simulation.snapshot(snapshot);
  Vec3 sum = Vec3::Zero();
  std::size_t count = 0;
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    if (snapshot.object[i] != object) continue;
    sum += vec(snapshot.world_position(i));
    ++count;
  }
  return sum / static_cast<double>(count);
}

double energy(const Metrics& m) { return m.kinetic_energy + m.elastic_energy + m.potential_energy; }

double share_asleep(const Solver& simulation) {
  const Metrics m = simulation.metrics();
  return static_cast<double>(m.particles_asleep) / static_cast<double>(m.particles);
}

}  // namespace

TEST_CASE("a bed at rest falls asleep where it would have stayed", "[physics]") {
  SolverSetup setup = on_ground(true), never = on_ground(false);
  setup.snow.push_back(bed());
  never.snow.push_back(bed());
  Solver sleeping(best_kernels(), setup), awake(best_kernels(), never);
  const Metrics before = sleeping.metrics();
  sleeping.advance_to(1.0);
  awake.advance_to(1.0);
  const Metrics a = sleeping.metrics(), b = awake.metrics();
  CHECK(a.particles_asleep == a.particles);
  CHECK(b.particles_asleep == 0);
  CHECK(a.kinetic_energy == 0);
  CHECK(a.mass == before.mass);
  CHECK(a.particle_steps < b.particle_steps);
  CHECK((center_of(sleeping, 0) - center_of(awake, 0)).norm() < 2e-3 * kDx);
  CHECK((bounds_of(a).max - bounds_of(b).max).norm() < 1e-2 * kDx);
  CHECK(a.elastic_energy == Approx(b.elastic_energy).epsilon(0.02));
}

TEST_CASE("snow that flies never sleeps, not where it is let go nor where it turns", "[physics]") {
  for (const double speed : {0.0, 0.7}) {
    SolverSetup setup = on_ground(true);
    setup.snow.push_back(ball(Vec3(0, 2, 0), 3 * kDx, kDx, Material{}, Vec3(0, speed, 0)));
    Solver simulation(best_kernels(), setup);
    setup.sleep = false;
    Solver never(best_kernels(), setup);
    while (simulation.time() < 0.3) {
      simulation.advance_to(simulation.time() + 0.01);
      REQUIRE(simulation.metrics().particles_asleep == 0);
    }
    never.advance_to(0.3);
    CHECK(vec(simulation.metrics().momentum).y() == Approx(vec(never.metrics().momentum).y()).epsilon(1e-4));
  }
}

TEST_CASE("without gravity, or when it is switched off, nothing sleeps", "[physics]") {
  SolverSetup floating = on_ground(true), off = on_ground(false);
  floating.gravity = Vec3::Zero();
  for (SolverSetup* setup : {&floating, &off}) {
    setup->snow.push_back(bed());
    Solver simulation(best_kernels(), *setup);
    simulation.advance_to(0.8);
    CHECK(simulation.metrics().particles_asleep == 0);
  }
}

TEST_CASE("a slide that gathers a hundredth of g is not stopped by sleep", "[physics]") {
  const double angle = 20 * M_PI / 180, friction = 0.35;
  SolverSetup setup = on_ground(true);
  setup.colliders[0].friction = friction;
  setup.gravity = 9.81 * Vec3(std::sin(angle), -std::cos(angle), 0);
  Material material = elastic();
  material.young_modulus = 1e6;
  setup.snow.push_back(fill(Vec3(0, 0.5 * kDx, 0), Vec3(12 * kDx, 4.5 * kDx, 8 * kDx), kDx, 2, material));
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.1);
  const double start = vec(simulation.metrics().momentum).x();
  simulation.advance_to(1.1);
  const Metrics m = simulation.metrics();
  const double expected = 9.81 * (std::sin(angle) - friction * std::cos(angle));
  REQUIRE(expected < 0.0135 * 9.81);
  CHECK((vec(m.momentum).x() - start) / m.mass == Approx(expected).epsilon(0.1));
}

TEST_CASE("a ball thrown onto a sleeping bed wakes it and goes where it goes without sleep", "[physics]") {
  Solver sleeping(best_kernels(), bed_and_ball(true)), awake(best_kernels(), bed_and_ball(false));
  sleeping.advance_to(0.55);
  awake.advance_to(0.55);
  const Metrics before = sleeping.metrics();
  CHECK(share_asleep(sleeping) > 0.85);  // all but the ball
  CHECK(vec(before.momentum).y() == Approx(vec(awake.metrics().momentum).y()).epsilon(1e-3));
  double least = 1;
  for (int k = 1; k <= 40; ++k) {
    sleeping.advance_to(0.55 + 0.01 * k);
    awake.advance_to(0.55 + 0.01 * k);
    const Metrics a = sleeping.metrics();
    least = std::min(least, share_asleep(sleeping));
    INFO(a.time);
    CHECK(energy(a) < energy(before) * (1 + 1e-6) + 1e-6);
    CHECK((center_of(sleeping, 1) - center_of(awake, 1)).norm() < 0.1 * kDx);
    CHECK((center_of(sleeping, 0) - center_of(awake, 0)).norm() < 0.02 * kDx);
  }
  CHECK(least == 0);
  CHECK(sleeping.metrics().mass == before.mass);
  sleeping.advance_to(2.5);
  CHECK(share_asleep(sleeping) == 1);
}

TEST_CASE("a sleeping tower struck at its foot goes where it goes without sleep", "[physics]") {
  Vec3 struck[2];
  for (const bool sleep : {false, true}) {
    SolverSetup setup = on_ground(sleep);
    Material firm;
    firm.young_modulus = 5e5;
    setup.snow.push_back(
        fill(Vec3(-4 * kDx, 4 * kDx, -4 * kDx), Vec3(4 * kDx, 16 * kDx, 4 * kDx), kDx, 2, firm));
    setup.snow.push_back(ball(Vec3(-10.3, 0.2, 0), 4 * kDx, kDx, firm, Vec3(12, 4, 0)));
    Solver simulation(best_kernels(), setup);
    simulation.advance_to(0.8);
    const Vec3 stood = center_of(simulation, 0);
    CHECK((share_asleep(simulation) > 0.7) == sleep);
    simulation.advance_to(1.1);
    CHECK(share_asleep(simulation) == 0);
    struck[sleep] = center_of(simulation, 0);
    CHECK((struck[sleep] - stood).norm() > 2 * kDx);
  }
  CHECK((struck[1] - struck[0]).norm() < 0.05 * kDx);
}

TEST_CASE("snow that sleeps on nothing falls, all of it, once something moves beside it", "[physics]") {
  Solver before(best_kernels(), bed_and_ball(true));
  before.advance_to(0.55);
  std::stringstream saved;
  before.save(saved);
  SolverSetup bottomless = bed_and_ball(true);  // the ground is gone while the bed sleeps
  bottomless.colliders[0] = plane(Vec3(0, -20, 0), Vec3(0, 1, 0), Contact::separating, 0.5);
  Solver simulation(best_kernels(), bottomless);
  simulation.load(saved);
  const Vec3 slept = center_of(simulation, 0);
  simulation.advance_to(0.75);  // struck at 0.6 s
  CHECK(share_asleep(simulation) == 0);
  const Vec3 falling = center_of(simulation, 0);
  simulation.advance_to(0.95);
  const Vec3 fallen = center_of(simulation, 0);
  CHECK(slept.y() - falling.y() > 0.5 * 9.81 * 0.1 * 0.1);
  CHECK((slept.y() - fallen.y()) > 0.5 * 9.81 * 0.3 * 0.3);
}

TEST_CASE("with sleep the bits are the same for 1, 2 and 4 threads on x86-64-v3 and v4", "[physics]") {
  std::uint64_t expected = 0;
  with_kernels_and_threads({1, 2, 4}, [&](const kernels::KernelTable& table) {
    Solver simulation(table, bed_and_ball(true));
    simulation.advance_to(0.6);
    CHECK(share_asleep(simulation) > 0.5);
    simulation.advance_to(0.65);
    const std::uint64_t hash = simulation.state_hash();
    if (expected == 0) expected = hash;
    CHECK(hash == expected);
  });
}

TEST_CASE("a simulation saved while part of it sleeps continues bit for bit", "[physics]") {
  Solver whole(best_kernels(), bed_and_ball(true));
  for (const double time :
       {0.3, 0.5, 0.61, 0.9}) {  // settling, asleep but for the ball, waking, settling again
    whole.advance_to(time);
    std::stringstream saved;
    whole.save(saved);
    Solver second(best_kernels(), bed_and_ball(true));
    second.load(saved);
    INFO(time << ", " << share_asleep(whole));
    CHECK(second.metrics().particles_asleep == whole.metrics().particles_asleep);
    whole.advance_to(time + 0.05);
    second.advance_to(time + 0.05);
    CHECK(second.state_hash() == whole.state_hash());
    CHECK(second.metrics().particles_asleep == whole.metrics().particles_asleep);
    CHECK(second.metrics().particle_steps == whole.metrics().particle_steps);
  }
}

}  // namespace firn::test::sleep
