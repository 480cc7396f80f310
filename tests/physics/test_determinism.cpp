// SPDX-License-Identifier: MIT
// The same bits for any number of threads, on x86-64-v3 and v4, saved and loaded or not, however often it is
// sorted.
#include <sstream>
#include <stop_token>

#include "firn/error.h"
#include "src/particles/fields.h"
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::determinism {
namespace {

// Balls of every material that hit each other and the ground at 10 m/s.
SolverSetup violent_impact() {
  SolverSetup setup;
  setup.dx = 0.02;
  Material chunky;
  chunky.critical_compression = 4e-2;
  Material neo_hookean;
  neo_hookean.model = kKindOf<kernels::NeoHookean>;
  Material clay;
  clay.model = kKindOf<kernels::CamClay>;
  clay.compressive_strength = 1e3;
  clay.hardening = 0.5;
  setup.snow.push_back(ball(Vec3(0, 0.1, 0), 0.09, setup.dx, Material{}, Vec3(5, -10, 0)));
  setup.snow.push_back(ball(Vec3(0.19, 0.1, 0.01), 0.09, setup.dx, chunky, Vec3(-10, -5, 1)));
  setup.snow.push_back(ball(Vec3(0.1, 0.28, 0.01), 0.07, setup.dx, neo_hookean, Vec3(0, -10, 0)));
  setup.snow.push_back(
      ball(Vec3(-0.19, 0.15, 0), 0.07, setup.dx, find_preset("sand").material, Vec3(10, -5, 0)));
  setup.snow.push_back(ball(Vec3(-0.07, 0.28, 0.02), 0.07, setup.dx, clay, Vec3(2, -10, 0)));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0.1, 1, 0), Contact::separating, 0.3));
  return setup;
}

std::uint64_t hash_with(const kernels::KernelTable& table, int threads, int steps) {
  std::uint64_t hash = 0;
  with_threads(threads, [&] {
    Solver simulation(table, violent_impact());
    for (int i = 0; i < steps; ++i) simulation.step(simulation.stable_step().dt);
    hash = simulation.state_hash();
  });
  return hash;
}

}  // namespace

TEST_CASE("200 steps of a violent impact give the same bits for 1, 2, 3 and 4 threads on x86-64-v3 and v4",
          "[physics]") {
  const auto tables = supported_kernels();
  std::uint64_t expected = 0;
  for (std::size_t t = 1; t < tables.size(); ++t) {
    for (const int threads : {1, 2, 3, 4}) {
      const std::uint64_t hash = hash_with(*tables[t], threads, 200);
      if (expected == 0) expected = hash;
      INFO(tables[t]->isa << ", " << threads << " threads");
      CHECK(hash == expected);
    }
  }
}

TEST_CASE("base gives its own bits, the same for any number of threads", "[physics]") {
  const auto& base = *supported_kernels().front();
  CHECK(hash_with(base, 1, 100) == hash_with(base, 4, 100));
}

TEST_CASE("a saved and loaded simulation continues bit for bit", "[physics]") {
  SolverSetup setup = violent_impact();
  setup.domain = Shape{Box{Vec3::Constant(0.35)}, Pose{}};
  Solver whole(best_kernels(), setup), first(best_kernels(), setup);
  whole.advance_to(0.01);
  first.advance_to(0.01);
  std::stringstream saved;
  first.save(saved);
  Solver second(best_kernels(), setup);
  second.load(saved);
  CHECK(second.time() == whole.time());
  CHECK(second.state_hash() == whole.state_hash());
  whole.advance_to(0.03);
  second.advance_to(0.03);
  CHECK(second.state_hash() == whole.state_hash());
  const Metrics a = whole.metrics(), b = second.metrics();
  CHECK(a.steps == b.steps);
  CHECK(a.particles_left == b.particles_left);
  CHECK(a.particle_steps == b.particle_steps);
  CHECK(a.kinetic_energy == b.kinetic_energy);
  CHECK(a.step.dt == b.step.dt);
  CHECK(a.step.cause == b.step.cause);
}

TEST_CASE("loading refuses what is cut short, of another scene, or no saved state at all", "[physics]") {
  Solver simulation(best_kernels(), violent_impact());
  const std::uint64_t before = simulation.state_hash();
  std::stringstream saved;
  simulation.save(saved);
  const std::string bytes = saved.str();
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{5}, std::size_t{90}, bytes.size() / 2, bytes.size() - 1}) {
    std::stringstream cut(bytes.substr(0, length));
    CHECK_THROWS_AS(simulation.load(cut), Error);
  }
  SolverSetup other = violent_impact();
  other.snow[0].material.young_modulus *= 2;
  std::stringstream whole(bytes);
  CHECK_THROWS_AS(Solver(best_kernels(), other).load(whole), Error);
  std::string far = bytes;  // the first particle, eight cells away
  far[bytes.size() - 4 * kColumns * simulation.particle_count() + 3] ^= 0x60;
  std::stringstream beyond(far);
  CHECK_THROWS_AS(simulation.load(beyond), Error);
  CHECK(simulation.state_hash() == before);
}

TEST_CASE("stopping between steps and going on changes no bit", "[physics]") {
  Solver straight(best_kernels(), violent_impact()), stopped(best_kernels(), violent_impact());
  std::stop_source stop;
  stop.request_stop();
  CHECK_FALSE(stopped.advance_to(0.005, stop.get_token()));
  CHECK(stopped.time() == 0);
  CHECK(stopped.advance_to(0.005));
  CHECK(straight.advance_to(0.005));
  CHECK(stopped.state_hash() == straight.state_hash());
  CHECK(stopped.time() == 0.005);
}

}  // namespace firn::test::determinism
