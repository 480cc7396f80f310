// SPDX-License-Identifier: MIT
// Simulations as programs of others have them: steps, views of the particles, snow that comes and goes.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <sstream>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <type_traits>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/refusal.h"
#include "tests/library/small_scenes.h"

namespace firn::test::simulation {

TEST_CASE("a simulation reaches each time exactly, with the same bits on any number of threads") {
  Simulation one(bed(), on(1)), two(bed(), on(2)), three(bed(), on(3));
  for (const double time : {0.01, 0.01, 0.005, 0.0333, 0.05}) {
    for (Simulation* s : {&one, &two, &three}) CHECK(s->advance_to(time));
    CHECK(one.time() == std::max(time, one.time()));
    CHECK(one.hash() == two.hash());
    CHECK(one.hash() == three.hash());
  }
  CHECK(one.time() == 0.05);
  const double before = one.time(), dt = one.step();
  CHECK(dt > 0);
  CHECK(one.time() == before + dt);
  CHECK(one.metrics().steps > two.metrics().steps);
  CHECK(refusal([&] { one.advance_to(NAN); }).code() == ErrorCode::usage);
}

TEST_CASE("a simulation takes the steps of a session, with the same particles") {
  const Scene scene = Scene::read(FIRN_SOURCE_ROOT "/tests/program/tiny.toml");
  Simulation by_frames(scene), at_once(scene);
  for (int frame = 1; frame < scene.frames(); ++frame) by_frames.advance_to(scene.frame_time(frame));
  CHECK(by_frames.time() == scene.frame_time(scene.frames() - 1));
  CHECK(by_frames.size() == at_once.size());
}

TEST_CASE("a stop leaves a simulation between two steps, from where it goes on to the same bits") {
  Simulation stopped(bed()), whole(bed());
  std::stop_source stop;
  stop.request_stop();
  CHECK_FALSE(stopped.advance_to(0.02, stop.get_token()));
  CHECK(stopped.time() == 0);
  CHECK(stopped.advance_to(0.02));
  whole.advance_to(0.02);
  CHECK(stopped.hash() == whole.hash());
}

TEST_CASE("a snapshot is one block of columns, and outlives the state that it is a copy of") {
  Simulation simulation(bed());
  simulation.advance_to(0.03);
  const Snapshot plain = simulation.snapshot();
  CHECK((plain.F.empty() && plain.J.empty() && plain.Jp.empty() && plain.stress.empty()));
  Snapshot full = simulation.snapshot({true, true, true, true});
  const std::uint64_t then = full.id[0];
  REQUIRE(full.size() == simulation.size());
  for (std::size_t k = 0; k < 3; ++k)
    CHECK(full.position.data() + k * full.position.stride() == full.position[k].data());
  const auto bytes = [](const auto* p) { return reinterpret_cast<const std::byte*>(p); };
  const std::byte* const first = bytes(full.position.data());
  const std::byte* const last = bytes(full.stress.data() + 8 * full.stress.stride() + full.size());
  for (const std::byte* p : {bytes(full.velocity.data()), bytes(full.density.data()), bytes(full.id.data()),
                             bytes(full.object.data()), bytes(full.rotation.data()), bytes(full.F.data())}) {
    CHECK((p > first && p < last));
    CHECK(reinterpret_cast<std::uintptr_t>(p) % 64 == 0);
  }
  for (std::size_t i = 0; i < full.size(); ++i) {
    const auto f = [&](std::size_t k) { return static_cast<double>(full.F[k][i]); };
    const double det = f(0) * (f(4) * f(8) - f(5) * f(7)) - f(1) * (f(3) * f(8) - f(5) * f(6)) +
                       f(2) * (f(3) * f(7) - f(4) * f(6));
    REQUIRE(full.J[i] == Approx(det * std::fabs(full.Jp[i])).epsilon(1e-5));
    REQUIRE(full.density[i] == Approx(400 / full.J[i]).epsilon(1e-5));
    REQUIRE(full.stress[1][i] == full.stress[3][i]);
  }
  simulation.advance_to(0.05);
  CHECK(full.time == 0.03);
  CHECK(full.id[0] == then);
  Snapshot copy = full;
  copy.position[0][0] += 1;
  CHECK(copy.position[0][0] != full.position[0][0]);
  const float* const where = copy.position.data();
  const Snapshot moved = std::move(copy);
  CHECK(moved.position.data() == where);
}

TEST_CASE("the stress in the middle of a block carries the snow that lies above") {
  constexpr double kHeight = 0.2;
  Simulation simulation(bed({0.2, kHeight, 0.2}));
  double carried = 0, weight = 0;
  for (int k = 0; k < 80; ++k) {  // it rings on, twice in 0.08 s
    simulation.advance_to(0.2 + 0.005 * k);
    const Snapshot snow = simulation.snapshot({.stress = true});
    for (std::size_t i = 0; i < snow.size(); ++i) {
      const double height = snow.world_position(i)[1];
      if (height < 0.08 || height > 0.12) continue;
      carried -= snow.stress[4][i];
      weight += 400 * kGravity * (kHeight - height);
    }
  }
  CHECK(carried == Approx(weight).epsilon(0.08));
}

TEST_CASE("snow that is added is as it would have been from the start, and nothing else changes") {
  Scene both = bed();
  both.add("snow", kBall);
  Simulation from_start(both), added(bed());
  const std::size_t before = added.size();
  CHECK(added.add_snow(kBall) == 1);
  CHECK(added.size() == from_start.size());
  CHECK(added.hash() == from_start.hash());
  const Snapshot snow = added.snapshot();
  std::set<std::uint32_t> ids(snow.id.begin(), snow.id.end());
  CHECK(ids.size() == added.size());
  CHECK(std::count(snow.object.begin(), snow.object.end(), 1) ==
        static_cast<std::ptrdiff_t>(added.size() - before));
  // Those that were there keep their bits.
  Simulation later(bed()), alone(bed());
  later.advance_to(0.05);
  alone.advance_to(0.05);
  later.add_snow(kBall);
  const Snapshot with = later.snapshot(), without = alone.snapshot();
  std::vector<double> height(without.size());
  for (std::size_t i = 0; i < without.size(); ++i) height[without.id[i]] = without.world_position(i)[1];
  for (std::size_t i = 0; i < with.size(); ++i) {
    if (with.object[i] == 0) REQUIRE(with.world_position(i)[1] == Approx(height[with.id[i]]).margin(1e-7));
  }
  const Metrics m = later.metrics(), n = alone.metrics();
  CHECK(m.mass > n.mass);
  CHECK(m.plastic_work == n.plastic_work);
  CHECK(later.advance_to(0.3));
  CHECK(later.metrics().particles == from_start.size());
}

TEST_CASE("added snow falls as it does alone, whatever lies asleep elsewhere, in a turned domain too") {
  for (const double turn : {0., 30.}) {
    Scene scene = bed({0.2, 0.2, 0.2});
    scene.set("simulation.domain_min", {-2, -1, -2}).set("simulation.domain_max", {2, 3, 2});
    scene.set("simulation.domain_rotation", {0, 0, turn}).set("snow.bed.preset", "powder");
    Simulation simulation(scene);
    simulation.advance_to(2.0);
    if (turn == 0) CHECK(simulation.metrics().particles_asleep == simulation.size());
    Table high = kBall;
    high[2].value = Value({0.1, 1.0, 0.1});
    simulation.add_snow(high);
    const double start = simulation.time();
    simulation.advance_to(start + 0.1);
    const Snapshot snow = simulation.snapshot();
    double height = 0, count = 0;
    for (std::size_t i = 0; i < snow.size(); ++i) {
      if (snow.object[i] != 1) continue;
      height += snow.world_position(i)[1];
      ++count;
    }
    CHECK(height / count == Approx(1.0 - 0.3 - 0.5 * kGravity * 0.01).margin(2e-3));
  }
}

TEST_CASE("snow cannot be added where something is, but for trim and allow_overlap") {
  Simulation simulation(with_plate());
  simulation.advance_to(0.02);
  const std::uint64_t before = simulation.hash();
  Table inside = kBall;
  inside[2].value = Value({0, 0.1, 0});
  const Error in_snow = refusal([&] { simulation.add_snow(inside); });
  CHECK_THAT(in_snow.what(), Catch::Matchers::Contains("snow that is there already"));
  CHECK_THAT(in_snow.where(), Catch::Matchers::Contains("test_simulation.cpp:"));
  inside[2].value = Value({0.4, 0.01, 0});
  CHECK_THAT(refusal([&] { simulation.add_snow(inside); }).what(), Catch::Matchers::Contains("the ground"));
  inside[2].value = Value({-0.2, 0.3, 0});
  CHECK_THAT(refusal([&] { simulation.add_snow(inside); }).what(),
             Catch::Matchers::Contains("collider 'plate'"));
  CHECK(refusal([&] { simulation.add_snow({{"shape", "ball"}}); }).code() == ErrorCode::usage);
  CHECK(refusal([&] { simulation.add_snow({{"shape", "bal"}, {"radius", 1}}); }).code() == ErrorCode::usage);
  Table far = kBall;
  far[2].value = Value({1e9, 0.3, 0});
  CHECK(refusal([&] { simulation.add_snow(far); }).code() == ErrorCode::usage);
  CHECK(simulation.hash() == before);
  Table trimmed = kBall;
  trimmed[2].value = Value({0, 0.13, 0});
  trimmed.push_back({"trim", true});
  CHECK(simulation.add_snow(trimmed) == 1);
  CHECK(simulation.advance_to(0.1));
  CHECK(simulation.metrics().max_speed < 4);
  trimmed.back() = {"allow_overlap", true};
  CHECK(simulation.add_snow(trimmed) == 2);
}

TEST_CASE("snow that is taken out is gone, and what lay on it falls") {
  Scene scene = bed({0.2, 0.2, 0.2});
  scene.set("snow.bed.preset", "powder");
  Simulation simulation(scene);
  simulation.advance_to(2.0);
  CHECK(simulation.metrics().particles_asleep == simulation.size());
  const Snapshot snow = simulation.snapshot();
  std::vector<std::uint32_t> low;
  for (std::size_t i = 0; i < snow.size(); ++i) {
    if (snow.world_position(i)[1] < 0.05) low.push_back(snow.id[i]);
  }
  std::reverse(low.begin(), low.end());
  low.push_back(4'000'000'000u);  // of no particle
  low.push_back(low.front());     // twice
  const double mass = simulation.metrics().mass;
  const std::size_t removed = simulation.remove_snow(low);
  CHECK(removed == low.size() - 2);
  CHECK(simulation.size() == snow.size() - removed);
  const Metrics now = simulation.metrics();
  CHECK(now.mass == Approx(mass * simulation.size() / snow.size()));
  CHECK(now.bounds_min[1] >= 0.049);
  CHECK(now.particles_asleep < simulation.size());
  simulation.advance_to(simulation.time() + 0.05);
  CHECK(simulation.metrics().momentum[1] / now.mass == Approx(-kGravity * 0.05).epsilon(0.02));
  CHECK(simulation.remove_snow({}) == 0);
  CHECK(simulation.remove_snow(low) == 0);
  // All of it, and then some again.
  const Snapshot rest = simulation.snapshot();
  CHECK(simulation.remove_snow(rest.id) == rest.size());
  CHECK(simulation.size() == 0);
  CHECK(simulation.advance_to(simulation.time() + 0.02));
  simulation.add_snow(kBall);
  CHECK(simulation.snapshot().id[0] >= snow.size());
  CHECK(simulation.advance_to(simulation.time() + 0.02));
}

TEST_CASE("the ground carries snow at rest, and the force is that of the last call") {
  Scene scene = bed({0.2, 0.2, 0.2});
  scene.set("snow.bed.preset", "powder");
  Simulation simulation(scene);
  CHECK(simulation.metrics().contacts.at(0).force == Vector3{});
  simulation.advance_to(2.0);
  simulation.advance_to(2.1);
  const Metrics m = simulation.metrics();
  CHECK(m.contacts.at(0).collider == "ground");
  CHECK(m.contacts[0].force[1] == Approx(m.mass * kGravity).epsilon(0.01));
  simulation.add_snow(kBall);
  int steps = 0;
  simulation.step();
  while (++steps < 400) simulation.step();  // the ball is on its way, then on the bed
  const double since = simulation.time(), dt = simulation.step();
  const double before = simulation.metrics().momentum[1];
  const double more = simulation.step();
  const Metrics after = simulation.metrics();
  CHECK(since + dt + more == Approx(simulation.time()));
  const double force = (after.momentum[1] - before) / more + after.mass * kGravity;
  CHECK(after.contacts[0].force[1] == Approx(force).epsilon(0.05).margin(0.05 * after.mass * kGravity));
}

// A copy would write into constant snapshots, or outlive its own.
static_assert(!std::is_copy_constructible_v<Column<float>> && !std::is_copy_assignable_v<Columns<float, 3>>);

TEST_CASE("taking out what is not there changes nothing") {
  Simulation one(bed()), two(bed());
  for (int k = 0; k < 40; ++k) {
    one.step();
    two.step();
    CHECK(two.remove_snow(std::vector<std::uint32_t>{4'000'000'000u}) == 0);
  }
  CHECK(one.hash() == two.hash());
  CHECK(one.time() == two.time());
}

TEST_CASE("a state goes on with kernels of its own bits alone") {
  for (const char* isa : {"base", "auto"}) {
    SimulationOptions options;
    options.isa = isa;
    Simulation simulation(bed(), options);
    simulation.advance_to(0.01);
    std::ostringstream out;
    simulation.save(out);
    simulation.advance_to(0.02);
    std::istringstream in(out.str());
    Simulation again = Simulation::load(in);  // whichever it has
    again.advance_to(0.02);
    CHECK(again.hash() == simulation.hash());
  }
  Simulation simulation(bed());
  std::ostringstream out;
  simulation.save(out);
  std::istringstream in(out.str());
  SimulationOptions base;
  base.isa = "base";
  if (Simulation(bed(), base).hash() == 0) FAIL("no state");
  CHECK_THAT(refusal([&] { Simulation::load(in, base); }).what(),
             Catch::Matchers::Contains("base and of AVX differ"));
}

TEST_CASE("options that nothing can have are refused") {
  SimulationOptions options;
  options.threads = -1;
  CHECK(refusal([&] { Simulation(bed(), options); }).where() == "threads");
  CHECK(refusal([&] { Renderer(bed(), {-5}); }).where() == "threads");
  CHECK(refusal([&] { check_scene(bed(), {-1}); }).where() == "threads");
  SessionOptions session;
  session.threads = -2;
  CHECK(refusal([&] { Session::start(bed(), session); }).where() == "threads");
  session.threads = 0;
  session.out = "";
  CHECK(refusal([&] { Session::start(bed(), session); }).where() == "out");
  CHECK_THAT(refusal([&] { Scene("a b").check(); }).what(),
             Catch::Matchers::Contains("test_simulation.cpp:"));
}

}  // namespace firn::test::simulation
