// SPDX-License-Identifier: MIT
// The force of each collider on the snow: weights, friction, impacts, and Newton's second law for the snow as
// a whole, frame by frame.
#include <chrono>
#include <cmath>
#include <sstream>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::forces {
namespace {

constexpr double kDx = 0.02, kG = 9.81;

Collider named(const std::string& name, Collider collider) {
  collider.name = name;
  return collider;
}

Collider ground(double friction = 0.5) {
  return named("ground", plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::separating, friction));
}

Collider box(const std::string& name, const Vec3& center, const Vec3& size, std::vector<MotionKey> keys) {
  Collider c;
  c.name = name;
  c.shape = {Box{0.5 * size}, {Mat3::Identity(), center}};
  c.motion = Motion(std::move(keys), center);
  return c;
}

Vec3 force_of(const Metrics& m, const std::string& collider) {
  for (const ContactForce& contact : m.contacts) {
    if (contact.collider == collider) return vec(contact.force);
  }
  FAIL("no force of " << collider);
  return Vec3::Zero();
}

Vec3 sum_of_forces(const Metrics& m) {
  Vec3 sum = Vec3::Zero();
  for (const ContactForce& contact : m.contacts) sum += vec(contact.force);
  return sum;
}

// A block that falls on the ground from a cell above it, and comes to rest packed a little.
SolverSetup dropped_block(const Vec3& gravity, double friction) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.gravity = gravity;
  setup.snow.push_back(fill(Vec3(-6, 2, -6) * kDx, Vec3(6, 8, 6) * kDx, kDx, 2, Material{}));
  setup.colliders.push_back(ground(friction));
  return setup;
}

// A long bed at rest and asleep after 0.7 s. From 0.8 s on a plate passes over one end of it, wakes it and
// does not touch it.
SolverSetup half_woken() {
  SolverSetup setup = dropped_block(Vec3(0, -kG, 0), 0.5);
  setup.snow[0] = fill(Vec3(-22, 2, -4) * kDx, Vec3(22, 6, 4) * kDx, kDx, 2, Material{});
  setup.colliders.push_back(
      box("plate", Vec3(-20, 11, 0) * kDx, Vec3(4, 4, 4) * kDx,
          {{0.8, Vec3::Zero(), Mat3::Identity()}, {1.3, Vec3(0, 0, 2 * kDx), Mat3::Identity()}}));
  return setup;
}

// A ball that hits the ground, a wall and a box that swings at it.
SolverSetup violent() {
  SolverSetup setup;
  setup.dx = kDx;
  setup.sleep = false;
  setup.snow.push_back(ball(Vec3(0, 0.2, 0), 0.12, kDx, Material{}, Vec3(4, -8, 1)));
  setup.colliders.push_back(ground(0.3));
  setup.colliders.push_back(named("wall", plane(Vec3(0.2, 0, 0), Vec3(-1, 0.2, 0), Contact::slip, 0.2)));
  const Mat3 turned = Eigen::AngleAxisd(1, Vec3::UnitZ()).toRotationMatrix();
  setup.colliders.push_back(box("bat", Vec3(-0.35, 0.15, 0), Vec3(0.2, 0.3, 0.3),
                                {{0, Vec3::Zero(), Mat3::Identity()}, {0.1, Vec3(0.4, 0.05, 0), turned}}));
  setup.colliders.back().contact = Contact::sticky;
  return setup;
}

}  // namespace

TEST_CASE("the ground bears the weight of a block at rest, awake and asleep", "[physics][figure]") {
  Curve curve("weight", "series,time_s,force_of_weight,asleep");
  for (const bool sleep : {false, true}) {
    SolverSetup setup = dropped_block(Vec3(0, -kG, 0), 0.5);
    setup.sleep = sleep;
    Solver simulation(best_kernels(), setup);
    for (int frame = 1; frame <= 40; ++frame) {
      simulation.advance_to(0.02 * frame);
      const Metrics now = simulation.metrics();
      curve.add(sleep ? "may sleep" : "awake",
                {now.time, force_of(now, "ground").y() / (now.mass * kG),
                 static_cast<double>(now.particles_asleep) / static_cast<double>(now.particles)});
    }
    simulation.advance_to(1.0);
    const Metrics m = simulation.metrics();
    CHECK(m.particles_asleep == (sleep ? m.particles : 0));
    const Vec3 force = force_of(m, "ground") / (m.mass * kG);
    INFO("asleep " << sleep << ", of the weight " << force.transpose());
    CHECK(force.y() == Approx(1).margin(0.01));
    CHECK(std::hypot(force.x(), force.z()) < 0.01);
  }
}

TEST_CASE("snow partly asleep weighs what it did asleep, each node counted once", "[physics]") {
  Solver simulation(best_kernels(), half_woken());
  simulation.advance_to(0.7);
  simulation.advance_to(0.79);
  const Metrics before = simulation.metrics();
  CHECK(before.particles_asleep == before.particles);
  for (const double time : {0.85, 0.9, 1.0, 1.1, 1.2}) {
    simulation.advance_to(time);
    const Metrics m = simulation.metrics();
    INFO(time << " s, asleep " << m.particles_asleep << " of " << m.particles << ", of the weight "
              << force_of(m, "ground").y() / (m.mass * kG));
    CHECK(m.particles_asleep > m.particles / 4);
    CHECK(m.particles_asleep < m.particles);
    CHECK(force_of(m, "ground").y() == Approx(m.mass * kG).epsilon(0.01));
    CHECK(force_of(m, "ground").y() == Approx(force_of(before, "ground").y()).epsilon(0.01));
    CHECK(force_of(m, "plate") == Vec3::Zero());
  }
}

TEST_CASE("a block that rests on a slope presses with m g cos and is held by m g sin", "[physics][figure]") {
  Curve curve("slope_weight", "series,time_s,force_of_weight,expected");
  const double angle = 20 * M_PI / 180;
  SolverSetup setup = dropped_block(kG * Vec3(std::sin(angle), -std::cos(angle), 0), 0.7);
  for (const bool sleep : {false, true}) {
    setup.sleep = sleep;
    Solver simulation(best_kernels(), setup);
    for (int frame = 1; frame <= 20; ++frame) {
      simulation.advance_to(0.05 * frame);
      const Metrics now = simulation.metrics();
      const Vec3 bears = force_of(now, "ground") / (now.mass * kG);
      const std::string which = sleep ? " (may sleep)" : " (awake)";
      curve.add("presses" + which, {now.time, bears.y(), std::cos(angle)});
      curve.add("holds" + which, {now.time, -bears.x(), std::sin(angle)});
    }
    simulation.advance_to(1.2);
    const Metrics m = simulation.metrics();
    const Vec3 force = force_of(m, "ground") / (m.mass * kG);
    INFO("asleep " << m.particles_asleep << " of " << m.particles << ", of the weight " << force.transpose());
    CHECK(force.y() == Approx(std::cos(angle)).epsilon(0.01));
    CHECK(force.x() == Approx(-std::sin(angle)).epsilon(0.01));
  }
}

TEST_CASE("a block that slides is held back by mu times what it presses with", "[physics]") {
  const double angle = 30 * M_PI / 180, mu = 0.25;
  Solver simulation(best_kernels(), dropped_block(kG * Vec3(std::sin(angle), -std::cos(angle), 0), mu));
  simulation.advance_to(0.5);
  simulation.advance_to(0.8);
  const Metrics m = simulation.metrics();
  const Vec3 force = force_of(m, "ground") / (m.mass * kG);
  INFO("of the weight " << force.transpose());
  CHECK(force.y() == Approx(std::cos(angle)).epsilon(0.02));
  CHECK(force.x() == Approx(-mu * force.y()).epsilon(0.002));
}

TEST_CASE("what the ground gives to a ball in an impact is the ball's change of momentum",
          "[physics][figure]") {
  Curve curve("impact", "series,time_s,impulse,expected");
  SolverSetup setup;
  setup.dx = kDx;
  setup.gravity = Vec3::Zero();
  setup.snow.push_back(ball(Vec3(0, 0.12, 0), 0.1, kDx, Material{}, Vec3(2, -5, 0)));
  setup.colliders.push_back(ground(0.3));
  Solver simulation(best_kernels(), setup);
  const Vec3 before = vec(simulation.metrics().momentum);
  Vec3 impulse = Vec3::Zero();
  for (int frame = 1; frame <= 20; ++frame) {
    simulation.advance_to(5e-3 * frame);
    const Metrics now = simulation.metrics();
    impulse += 5e-3 * force_of(now, "ground");
    const Vec3 gained = vec(now.momentum) - before;
    curve.add("upwards", {now.time, impulse.y() / now.mass, gained.y() / now.mass});
    curve.add("along the ground", {now.time, impulse.x() / now.mass, gained.x() / now.mass});
  }
  const Vec3 change = vec(simulation.metrics().momentum) - before;
  INFO("impulse " << impulse.transpose() << ", change " << change.transpose());
  CHECK(change.y() > 0.9 * std::abs(before.y()));
  CHECK((impulse - change).norm() < 1e-3 * change.norm());
}

TEST_CASE("the two sides of a groove bear a ball together, each half", "[physics]") {
  for (const bool sleep : {false, true}) {
    SolverSetup setup;
    setup.dx = kDx;
    setup.sleep = sleep;
    setup.snow.push_back(ball(Vec3(0, 0.17, 0), 0.1, kDx, Material{}, Vec3::Zero()));
    setup.colliders.push_back(named("left", plane(Vec3::Zero(), Vec3(1, 1, 0), Contact::separating, 0)));
    setup.colliders.push_back(named("right", plane(Vec3::Zero(), Vec3(-1, 1, 0), Contact::separating, 0)));
    Solver simulation(best_kernels(), setup);
    simulation.advance_to(1.0);
    simulation.advance_to(1.4);
    const Metrics m = simulation.metrics();
    const Vec3 left = force_of(m, "left") / (m.mass * kG), right = force_of(m, "right") / (m.mass * kG);
    INFO("asleep " << m.particles_asleep << " of " << m.particles << ", of the weight " << left.transpose()
                   << " and " << right.transpose());
    CHECK((left + right - Vec3(0, 1, 0)).norm() < 0.01);
    CHECK((left - Vec3(0.5, 0.5, 0)).norm() < 0.02);
  }
}

TEST_CASE("a plate that presses on a bed adds its force to what the ground bears", "[physics]") {
  SolverSetup setup = dropped_block(Vec3(0, -kG, 0), 0.5);
  setup.colliders.push_back(
      box("plate", Vec3(0, 12, 0) * kDx, Vec3(8, 4, 8) * kDx,
          {{0.6, Vec3::Zero(), Mat3::Identity()}, {1.0, Vec3(0, -4.5 * kDx, 0), Mat3::Identity()}}));
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.6);
  double sum = 0, last = 0;
  const int frames = 10;
  for (int frame = 1; frame <= frames; ++frame) {
    simulation.advance_to(0.6 + 0.4 * frame / frames);
    const Metrics m = simulation.metrics();
    last = force_of(m, "plate").y();
    sum += last + force_of(m, "ground").y();
    CHECK(last <= 0);
  }
  const double weight = simulation.metrics().mass * kG;
  INFO("mean of both " << sum / frames << " N, weight " << weight << " N, plate at last " << last << " N");
  CHECK(sum / frames == Approx(weight).epsilon(0.02));  // the snow is as slow at the end as before
  CHECK(-last > 5 * weight);

  simulation.advance_to(2.5);  // the plate stands, the snow falls asleep under it
  simulation.advance_to(2.6);
  const Metrics m = simulation.metrics();
  const double plate = force_of(m, "plate").y(), bears = force_of(m, "ground").y();
  INFO("asleep " << m.particles_asleep << " of " << m.particles << ": " << plate << " N and " << bears
                 << " N");
  CHECK(m.particles_asleep == m.particles);
  CHECK(-plate > weight);
  CHECK(plate + bears == Approx(weight).epsilon(0.02));
  std::stringstream saved;
  simulation.save(saved);
  Solver loaded(best_kernels(), setup);
  loaded.load(saved);
  loaded.advance_to(2.7);
  simulation.advance_to(2.7);
  for (const char* name : {"plate", "ground"})
    CHECK(force_of(loaded.metrics(), name) == force_of(simulation.metrics(), name));
}

TEST_CASE("gravity and the colliders' forces are the change of momentum, frame by frame",
          "[physics][figure]") {
  Curve curve("second_law", "series,time_s,from_forces,expected");
  Solver simulation(best_kernels(), violent());
  Metrics last = simulation.metrics();
  Vec3 most[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  for (int frame = 1; frame <= 40; ++frame) {
    simulation.advance_to(4e-3 * frame);
    const Metrics now = simulation.metrics();
    const double time = now.time - last.time;
    const Vec3 expected = time * (now.mass * Vec3(0, -kG, 0) + sum_of_forces(now));
    const Vec3 change = vec(now.momentum) - vec(last.momentum);
    INFO(now.time << " s: " << change.transpose() << " against " << expected.transpose());
    CHECK((change - expected).norm() < 2e-6 * now.mass * 9);  // of a speed of 9 m/s
    const double scale = 1 / (now.mass * time);
    curve.add("x", {now.time, expected.x() * scale, change.x() * scale});
    curve.add("y", {now.time, expected.y() * scale, change.y() * scale});
    for (std::size_t k = 0; k < 3; ++k) most[k] = most[k].cwiseMax(vec(now.contacts[k].force).cwiseAbs());
    last = now;
  }
  for (const Vec3& of_collider : most) CHECK(of_collider.norm() > 10 * last.mass * kG);  // they all took part
}

TEST_CASE("forces and plastic work have the same bits on any number of threads, on v3 and v4", "[physics]") {
  for (const SolverSetup& setup : {violent(), half_woken()}) {
    std::vector<Metrics> all;
    with_kernels_and_threads({1, 3}, [&](const kernels::KernelTable& table) {
      Solver simulation(table, setup);
      simulation.advance_to(setup.sleep ? 0.95 : 0.05);
      all.push_back(simulation.metrics());
    });
    for (const Metrics& m : all) {
      for (std::size_t k = 0; k < m.contacts.size(); ++k) {
        CHECK(vec(m.contacts[k].force) == vec(all[0].contacts[k].force));
      }
      CHECK(m.plastic_work == all[0].plastic_work);
      CHECK(m.plastic_work > 0);
    }
  }
}

TEST_CASE("a run that is stopped within a frame, saved and loaded tells the same forces", "[physics]") {
  Solver whole(best_kernels(), violent()), stopped(best_kernels(), violent());
  for (Solver* simulation : {&whole, &stopped}) simulation->advance_to(0.01);
  while (stopped.time() == 0.01) {  // a busy machine may stop it before its first step
    std::stop_source stop;
    std::thread stopper([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      stop.request_stop();
    });
    const bool arrived = stopped.advance_to(0.2, stop.get_token());
    stopper.join();
    REQUIRE_FALSE(arrived);
  }
  std::stringstream saved;
  stopped.save(saved);
  Solver loaded(best_kernels(), violent());
  loaded.load(saved);
  loaded.advance_to(0.2);
  whole.advance_to(0.2);
  const Metrics a = whole.metrics(), b = loaded.metrics();
  for (std::size_t k = 0; k < a.contacts.size(); ++k)
    CHECK(vec(a.contacts[k].force) == vec(b.contacts[k].force));
  CHECK(a.plastic_work == b.plastic_work);
}

TEST_CASE("snow saved asleep, and partly asleep, weighs the same bits when loaded", "[physics]") {
  Solver whole(best_kernels(), half_woken());
  for (const double time : {0.72, 0.9, 1.2}) {
    whole.advance_to(time);
    std::stringstream saved;
    whole.save(saved);
    Solver loaded(best_kernels(), half_woken());
    loaded.load(saved);
    INFO(time);
    for (const double later : {time, time + 0.02}) {
      whole.advance_to(later);
      loaded.advance_to(later);
      const Metrics a = whole.metrics(), b = loaded.metrics();
      CHECK(a.particles_asleep > 0);
      CHECK(vec(a.contacts[0].force) == vec(b.contacts[0].force));
      CHECK(a.plastic_work == b.plastic_work);
    }
  }
}

TEST_CASE("a saved run is refused when a collider now moves otherwise", "[physics]") {
  std::stringstream saved;
  Solver(best_kernels(), half_woken()).save(saved);
  const auto refused = [&](const Motion& motion) {
    SolverSetup setup = half_woken();
    setup.colliders[1].motion = motion;
    std::stringstream in(saved.str());
    CHECK_THROWS_WITH(Solver(best_kernels(), setup).load(in), contains("their motion"));
  };
  const Vec3 pivot(-0.4, 0.22, 0);
  refused(Motion());
  refused(Motion({{0.8, Vec3::Zero(), Mat3::Identity()}}, pivot));
  refused(Motion({{0.8, Vec3::Zero(), Mat3::Identity()}, {1.3, Vec3(0, 0, 0.041), Mat3::Identity()}}, pivot));
  refused(Motion({{0.8, Vec3::Zero(), Mat3::Identity()}, {1.4, Vec3(0, 0, 0.04), Mat3::Identity()}}, pivot));
  std::stringstream in(saved.str());
  CHECK_NOTHROW(Solver(best_kernels(), half_woken()).load(in));
}

}  // namespace firn::test::forces
