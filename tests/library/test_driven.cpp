// SPDX-License-Identifier: MIT
// Colliders that a program drives, and states that are saved and gone on with.
#include <cmath>
#include <cstdint>
#include <functional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/refusal.h"
#include "tests/library/small_scenes.h"

namespace firn::test::driven {
namespace {

std::string saved(const Simulation& simulation) {
  std::ostringstream out;
  simulation.save(out);
  return out.str();
}

Simulation loaded(const std::string& bytes, int threads = 2) {
  std::istringstream in(bytes);
  return Simulation::load(in, on(threads));
}

// Of the snow on a collider that nothing else touches: pushes it along x with a force, from rest.
struct Pushed {
  double force, mass, speed = 0;
  ColliderVelocity operator()(const DrivenCollider& now) {
    speed += now.dt * (force + now.force[0]) / mass;
    return {{speed, 0, 0}, {}};
  }
};

}  // namespace

TEST_CASE("changes give the same bits on any number of threads, and go on from a saved state") {
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 2, 5}) {
    Simulation simulation(with_plate(), on(threads));
    simulation.drive("plate", Pushed{300, 5});
    simulation.advance_to(0.05);
    simulation.add_snow(kBall);
    const Snapshot snow = simulation.snapshot();
    simulation.remove_snow(std::span(snow.id.data(), 50));
    simulation.advance_to(0.08);
    hashes.push_back(simulation.hash());
  }
  CHECK(hashes[0] == hashes[1]);
  CHECK(hashes[0] == hashes[2]);
}

TEST_CASE("a saved state goes on to the same bits, with all that was added, taken out and driven") {
  for (const double moment : {0.0, 0.02, 0.0513}) {
    Simulation whole(with_plate(20));
    Pushed push{300, 5};
    const auto driver = [&push](const DrivenCollider& now) { return push(now); };
    whole.drive("plate", driver);
    whole.advance_to(moment);
    whole.add_snow(kBall);
    const Snapshot snow = whole.snapshot();
    whole.remove_snow(std::span(snow.id.data(), 20));
    if (moment > 0) whole.advance_to(moment + 0.01);
    const std::string bytes = saved(whole);
    const double speed = push.speed;
    whole.advance_to(0.09);

    Simulation again = loaded(bytes, 3);
    push.speed = speed;
    if (moment > 0) {
      const Error error = refusal([&] { again.advance_to(0.09); });
      CHECK_THAT(error.what(), Catch::Matchers::Contains("'plate' was driven"));
    }
    again.drive("plate", driver);
    again.advance_to(0.09);
    CHECK(again.hash() == whole.hash());
    CHECK(again.metrics().contacts[1].force == whole.metrics().contacts[1].force);
    again.add_snow({{"shape", "ball"}, {"radius", 0.03}, {"center", {0.3, 0.5, 0}}});
    const Snapshot now = again.snapshot();
    CHECK(std::set<std::uint32_t>(now.id.begin(), now.id.end()).size() == now.size());
  }
}

TEST_CASE("a saved state knows how fast and how stiff the snow was that was added") {
  Simulation whole(bed());
  whole.advance_to(0.01);
  whole.add_snow({{"name", "shot"},
                  {"shape", "ball"},
                  {"radius", 0.04},
                  {"center", {0, 1.5, 0}},
                  {"velocity", {0, -25, 0}},
                  {"density", 900},
                  {"young_modulus", 5e6}});
  whole.advance_to(0.02);
  Simulation again = loaded(saved(whole));
  CHECK(saved(again) == saved(whole));
  for (const double time : {0.03, 0.06}) {  // the second is after the impact
    whole.advance_to(time);
    again.advance_to(time);
    CHECK(again.hash() == whole.hash());
    CHECK(again.metrics().plastic_work == whole.metrics().plastic_work);
  }
}

TEST_CASE("a damaged saved state is refused") {
  Simulation simulation(bed());
  simulation.advance_to(0.01);
  const std::string whole = saved(simulation);
  CHECK(loaded(whole).hash() == simulation.hash());
  for (const std::size_t at :
       {std::size_t{0}, std::size_t{9}, std::size_t{14}, whole.size() / 2, whole.size() - 1}) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 4);
    CHECK(refusal([&] { loaded(bytes); }).code() == ErrorCode::io);
  }
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{7}, std::size_t{12}, std::size_t{40}, whole.size() - 1})
    CHECK(refusal([&] { loaded(whole.substr(0, size)); }).code() == ErrorCode::io);
  CHECK(refusal([&] { loaded(whole + "x"); }).code() == ErrorCode::io);
  std::ostringstream full;
  full.setstate(std::ios::badbit);
  CHECK(refusal([&] { simulation.save(full); }).code() == ErrorCode::io);
}

TEST_CASE("a driven collider moves as its driver says, in a turned domain too") {
  for (const double turn : {0., 25.}) {
    Scene scene = with_plate();
    scene.set("simulation.domain_min", {-2, -1, -2}).set("simulation.domain_max", {2, 2, 2});
    scene.set("simulation.domain_rotation", {0, 0, turn});
    Simulation simulation(scene);
    std::vector<DrivenCollider> seen;
    simulation.drive("plate", [&](const DrivenCollider& now) {
      seen.push_back(now);
      return ColliderVelocity{{-0.5, 0.1, 0}, {0, 2, 0}};
    });
    simulation.advance_to(0.05);
    CHECK(seen.size() == simulation.metrics().steps);
    CHECK(seen.front().dt == 0);
    CHECK(seen.front().position[0] == Approx(-0.2).margin(1e-12));
    double time = 0;
    for (std::size_t k = 1; k < seen.size(); ++k) {
      time += seen[k].dt;
      REQUIRE(seen[k].time == Approx(time));
      REQUIRE(seen[k].position[0] == Approx(-0.2 - 0.5 * time).margin(1e-9));
      REQUIRE(seen[k].position[1] == Approx(0.2 + 0.1 * time).margin(1e-9));
      REQUIRE(seen[k].rotation[0] == Approx(std::cos(2 * time)).margin(1e-9));
      REQUIRE(seen[k].rotation[2] == Approx(std::sin(2 * time)).margin(1e-9));
      REQUIRE(seen[k].angular_velocity[1] == Approx(2).margin(1e-12));
    }
  }
}

TEST_CASE("a driven collider does to the snow what the same motion of the scene does") {
  Scene moved = with_plate();
  moved.set("collider.plate.motion", Value({Table{{"time", 0}, {"position", {0, 0, 0}}},
                                            Table{{"time", 1}, {"position", {1, 0, 0}}}}));
  Simulation scripted(moved), driven(with_plate());
  driven.drive("plate", [](const DrivenCollider&) { return ColliderVelocity{{1, 0, 0}, {}}; });
  scripted.advance_to(0.15);
  driven.advance_to(0.15);
  const Metrics a = scripted.metrics(), b = driven.metrics();
  CHECK(a.momentum[0] > 0.1 * a.mass);
  CHECK(b.momentum[0] == Approx(a.momentum[0]).epsilon(0.01));
  CHECK(b.kinetic_energy == Approx(a.kinetic_energy).epsilon(0.02));
}

TEST_CASE("force and torque on a driven collider are what the snow loses") {
  // No ground and no gravity: only the plate acts on the snow.
  Scene scene("free");
  scene.set("simulation.dx", kDx).set("simulation.gravity", {0, 0, 0});
  scene.add("snow", {{"shape", "ball"}, {"radius", 0.08}, {"center", {0, 0.05, 0.03}}});
  scene.add("collider",
            {{"name", "plate"}, {"shape", "box"}, {"size", {0.1, 0.5, 0.5}}, {"center", {-0.15, 0.1, 0}}});
  Simulation simulation(scene);
  Vector3 impulse{}, moment{};
  const Vector3 pivot = {-0.15, 0.1, 0};
  DrivenCollider last;
  const auto take = [&](const DrivenCollider& now) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
      impulse[k] -= now.dt * now.force[k];
      moment[k] -= now.dt * (now.torque[k] + now.position[a] * now.force[b] - now.position[b] * now.force[a]);
    }
  };
  simulation.drive("plate", [&](const DrivenCollider& now) {
    take(now);
    last = now;
    return ColliderVelocity{{2, 0, 0.5}, {0, 0, 0.5}};
  });
  simulation.advance_to(0.06);
  simulation.step();  // tells of the last step before it
  const Metrics after = simulation.metrics();
  CHECK(impulse[0] > 0.5 * after.mass);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(impulse[k] == Approx(after.momentum[k]).margin(0.01 * impulse[0]));
    CHECK(moment[k] == Approx(after.angular_momentum[k]).margin(0.02 * impulse[0] * 0.1));
  }
  CHECK(last.position[0] > pivot[0] + 0.1);
}

TEST_CASE("what a driver may not do is refused, and what it throws comes out") {
  Scene scene = with_plate();
  scene.add("collider", {{"name", "mill"},
                         {"shape", "box"},
                         {"size", {0.1, 0.1, 0.1}},
                         {"center", {0.5, 0.2, 0}},
                         {"motion", Value({Table{{"time", 0}, {"position", {0, 0, 0}}},
                                           Table{{"time", 1}, {"position", {0, 1, 0}}}})}});
  Simulation simulation(scene);
  const auto still = [](const DrivenCollider&) { return ColliderVelocity{}; };
  CHECK_THAT(refusal([&] { simulation.drive("plat", still); }).what(), Catch::Matchers::Contains("plate"));
  CHECK_THAT(refusal([&] { simulation.drive("mill", still); }).what(),
             Catch::Matchers::Contains("motion of its own"));
  CHECK(refusal([&] { simulation.drive("plate", {}); }).code() == ErrorCode::usage);
  simulation.drive("plate", [](const DrivenCollider&) { return ColliderVelocity{{NAN, 0, 0}, {}}; });
  CHECK_THAT(refusal([&] { simulation.advance_to(0.1); }).what(), Catch::Matchers::Contains("not finite"));
  simulation.drive("plate", [](const DrivenCollider& now) -> ColliderVelocity {
    if (now.time > 0.01) throw std::runtime_error("enough");
    return {};
  });
  CHECK_THROWS_WITH(simulation.advance_to(0.1), "enough");
  CHECK(simulation.time() > 0.01);
  simulation.drive("plate", still);
  CHECK(simulation.advance_to(0.1));
}

TEST_CASE("a driver may look at its simulation, but neither step nor change it") {
  Scene scene = with_plate();
  scene.add("collider", {{"name", "other"}, {"shape", "ball"}, {"radius", 0.05}, {"center", {0.4, 0.3, 0}}});
  Simulation simulation(scene);
  std::vector<std::uint32_t> ids = {0};
  const auto still = [](const DrivenCollider&) { return ColliderVelocity{}; };
  const std::vector<std::function<void()>> forbidden = {
      [&] { simulation.step(); },
      [&] { simulation.advance_to(1); },
      [&] { simulation.drive("plate", still); },
      [&] { simulation.drive("other", still); },
      [&] { simulation.add_snow(kBall); },
      [&] { simulation.remove_snow(ids); },
  };
  for (const auto& act : forbidden) {
    simulation.drive("plate", [&](const DrivenCollider& now) {
      CHECK(simulation.metrics().time == now.time);
      act();
      return ColliderVelocity{{1, 0, 0}, {}};
    });
    const std::uint64_t before = simulation.hash();
    CHECK_THAT(refusal([&] { simulation.step(); }).what(), Catch::Matchers::Contains("a driver may look"));
    CHECK(simulation.hash() == before);
    simulation.drive("plate", still);
    simulation.step();
  }
}

TEST_CASE("velocities that no step can follow are refused, and those of a failed step are forgotten") {
  Simulation simulation(with_plate());
  DrivenCollider told;
  ColliderVelocity wanted;
  simulation.drive("plate", [&](const DrivenCollider& now) {
    told = now;
    return wanted;
  });
  for (const ColliderVelocity& huge :
       {ColliderVelocity{{1e300, 0, 0}, {}}, ColliderVelocity{{}, {0, 1e300, 0}}}) {
    wanted = {};
    simulation.step();
    wanted = huge;
    CHECK_THROWS_AS(simulation.advance_to(simulation.time() + 0.01), Error);
    wanted = {};
  }
  Simulation other(with_plate());
  other.drive("plate", [&](const DrivenCollider& now) -> ColliderVelocity {
    told = now;
    if (now.time > 0) throw std::runtime_error("enough");
    return {{0.25, 0, 0}, {}};
  });
  other.step();
  CHECK_THROWS_WITH(other.step(), "enough");
  CHECK_THROWS_WITH(other.step(), "enough");
  CHECK(told.velocity == Vector3{0.25, 0, 0});
}

}  // namespace firn::test::driven
