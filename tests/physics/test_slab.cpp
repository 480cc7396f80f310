// SPDX-License-Identifier: MIT
// Release of a slab: a stiff slab on a weak layer stands on a slope until the layer is broken at one spot;
// then the fracture runs through the layer and the slab goes, down to where the weak layer ends. A strip of
// scenes/slab_release.toml, six cells wide, seen along the slope.
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::slab {
namespace {

constexpr double kDx = 0.2;
constexpr double kTilt = 38 * M_PI / 180;
constexpr double kLength = 10, kCrown = 2, kWidth = 6 * kDx;  // m; the weak layer begins at the crown
constexpr double kSlope = 0.55 * kDx, kBase = kSlope + 0.4,
                 kTop = kBase + 0.8;                // m; just above a row of nodes
constexpr double kTrigger = 4.5, kTriggered = 0.8;  // m and s

Material well_bonded() {
  Material m = find_preset("packed").material;
  m.young_modulus = 1e6;
  return m;
}

// A weight that is pressed into the slab, quickly, and stays there.
Collider weight() {
  Collider c;
  c.name = "weight";
  c.shape = {Ball{0.5}, {Mat3::Identity(), Vec3(kTrigger, kTop + 0.5 + kDx, 0)}};
  const Mat3 upright = Mat3::Identity();
  c.motion = Motion({{kTriggered, Vec3::Zero(), upright}, {kTriggered + 0.15, Vec3(0, -0.8, 0), upright}},
                    c.shape.pose.translation);
  c.friction = 0.2;
  return c;
}

SolverSetup slope(const Material& under_slab, bool triggered) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.gravity = 9.81 * Vec3(std::sin(kTilt), -std::cos(kTilt), 0);
  const auto layer = [&](double from, double to, double low, double high, const Material& material) {
    // On a lattice of its own: the heights need not be whole cells.
    PlacedSnow snow = fill(Vec3(from, 0, -kWidth / 2), Vec3(to, high - low, kWidth / 2), kDx, 2, material);
    for (Vec3& x : snow.position) x.y() += low;
    setup.snow.push_back(std::move(snow));
  };
  layer(0, kLength, kBase, kTop, find_preset("dry_slab").material);
  layer(kCrown, kLength, kSlope, kBase, under_slab);
  layer(0, kCrown, kSlope, kBase, well_bonded());
  Collider ground;
  ground.name = "slope";
  ground.shape = {Box{Vec3(kLength, 1, kWidth)}, {Mat3::Identity(), Vec3(0, kSlope - 1, 0)}};
  ground.contact = Contact::sticky;
  setup.colliders.push_back(ground);  // it ends where the slab does
  if (triggered) setup.colliders.push_back(weight());
  return setup;
}

// Of the slab's part that was placed between `from` and `to`: mean way and mean speed down the slope.
struct Part {
  double way = 0, speed = 0;  // m, m/s
};
Part part_of(const Solver& simulation, const SolverSetup& placed, double from, double to) {
  Snapshot s;
  simulation.snapshot(s);
  Part part;
  double count = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s.object[i] != 0) continue;
    const double start = placed.snow[0].position[s.id[i]].x();  // the slab's ids come first
    if (start < from || start >= to) continue;
    part.way += vec(s.world_position(i)).x() - start;
    part.speed += s.velocity[0][i];
    ++count;
  }
  return {part.way / count, part.speed / count};
}

}  // namespace

TEST_CASE("a slab on a weak layer stands on 38 degrees", "[physics][figure]") {
  Curve curve("slab_uncut", "series,time_s,way_m");
  const SolverSetup setup = slope(find_preset("weak_layer").material, false);
  Solver simulation(best_kernels(), setup);
  for (int k = 1; k <= 24; ++k) {
    const double time = 0.1 * k;
    simulation.advance_to(time);
    const Part slab = part_of(simulation, setup, kCrown, kLength);
    curve.add("not struck", {time, slab.way});
    INFO(time << " s");
    CHECK(std::abs(slab.way) < 0.02);
    // Gravity comes on at once, and the slab swings on the layer by 2 mm in 0.4 s, 0.1 m/s at first.
    if (k % 8 == 0) CHECK(std::abs(slab.speed) < 0.05);
  }
}

TEST_CASE("broken at one spot, the weak layer lets the whole slab below go, and the snow above it stays",
          "[physics][figure]") {
  const SolverSetup setup = slope(find_preset("weak_layer").material, true);
  Solver simulation(best_kernels(), setup);
  Curve curve("slab_struck", "series,time_s,way_m");
  const auto advance_to = [&](double time) {
    for (double t = simulation.time() + 0.1; t < time - 0.05; t += 0.1) {
      simulation.advance_to(t);
      curve.add("struck: below", {t, part_of(simulation, setup, kTrigger + 0.5, kLength).way});
      curve.add("struck: crown", {t, part_of(simulation, setup, 0, kCrown).way});
    }
    simulation.advance_to(time);
  };
  advance_to(kTriggered);
  CHECK(std::abs(part_of(simulation, setup, kCrown, kLength).speed) < 0.05);
  advance_to(kTriggered + 0.4);  // 5 m from the trigger and more
  CHECK(part_of(simulation, setup, 8, kLength).speed > 0.5);
  advance_to(kTriggered + 1.2);
  const Part below = part_of(simulation, setup, kTrigger + 0.5, kLength),
             crown = part_of(simulation, setup, 0, kCrown);
  CHECK(below.way > 0.5);
  CHECK(below.speed > 0.8);
  CHECK(std::abs(crown.way) < 0.05);
  CHECK(std::abs(crown.speed) < 0.05);
}

TEST_CASE("on well bonded snow the same slab bears the same blow", "[physics]") {
  const SolverSetup setup = slope(well_bonded(), true);
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(kTriggered + 1.2);
  const Part below = part_of(simulation, setup, kTrigger + 1, kLength);
  CHECK(std::abs(below.speed) < 0.05);
  CHECK(std::abs(below.way) < 0.05);
}

}  // namespace firn::test::slab
