// SPDX-License-Identifier: MIT
// Every preset lasts, and presets alone make snows that behave apart: a plate of powder does not bear its own
// weight over a gap, one of ice crust does, and breaks into hard pieces when it is struck. As in
// scenes/powder_and_crust.toml.
#include <algorithm>
#include <cmath>

#include "src/scene/presets.h"
#include "src/scene/scene.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::presets {
namespace {

constexpr double kDx = 0.025, kHead = 0.3, kThick = 0.1, kHalf = 0.225;  // m: head of the posts, plate

// A plate on two posts, a floor under them, and a bar that is pressed through the middle after 0.3 s.
SolverSetup bridge(const Material& material) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(fill(Vec3(-kHalf, kHead, -0.1), Vec3(kHalf, kHead + kThick, 0.1), kDx, 2, material));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0, 1, 0), Contact::separating, 0.4));
  for (const double side : {-1, 1}) {
    Collider post;
    post.shape = {Box{Vec3(0.08, kHead / 2, 0.15)}, {Mat3::Identity(), Vec3(0.22 * side, kHead / 2, 0)}};
    post.friction = 0.5;
    setup.colliders.push_back(post);
  }
  Collider bar;
  bar.name = "bar";
  bar.shape = {Capsule{0.05, 0.2},
               {Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()).toRotationMatrix(), Vec3(0, 0.48, 0)}};
  bar.motion = Motion({{0.3, Vec3::Zero(), Mat3::Identity()},
                       {0.5, Vec3(0, -0.2, 0), Mat3::Identity()},
                       {0.8, Vec3(0, 0.1, 0), Mat3::Identity()}},
                      bar.shape.pose.translation);
  bar.friction = 0.3;
  setup.colliders.push_back(bar);
  return setup;
}

// m; of the particles of the middle tenth of the plate: how far they have sunk, on the mean.
double sag(const Solver& simulation, const SolverSetup& placed) {
  Snapshot s;
  simulation.snapshot(s);
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const Vec3& start = placed.snow[0].position[s.id[i]];
    if (std::abs(start.x()) > 0.1 * kHalf) continue;
    sum += start.y() - vec(s.world_position(i)).y();
    ++count;
  }
  return sum / count;
}

// The part of neighbours along the plate that are neighbours still, to a tenth of their distance.
double kept_together(const Solver& simulation, const SolverSetup& placed) {
  Snapshot s;
  simulation.snapshot(s);
  std::vector<Vec3> now(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) now[s.id[i]] = vec(s.world_position(i));
  const auto& start = placed.snow[0].position;
  const auto next = static_cast<std::size_t>(
      std::find_if(start.begin(), start.end(), [&](const Vec3& x) { return x.x() > start[0].x(); }) -
      start.begin());  // fill() goes along x last
  double kept = 0;
  for (std::size_t i = 0; i + next < now.size(); ++i)
    kept += std::abs((now[i + next] - now[i]).norm() / (0.5 * kDx) - 1) < 0.1;
  return kept / static_cast<double>(now.size() - next);
}

}  // namespace

TEST_CASE(
    "from presets alone powder runs down through a gap, and ice crust bears itself and breaks into pieces",
    "[physics][figure]") {
  Curve curve("bridge", "series,time_s,sag_m");
  const SolverSetup powder = bridge(find_preset("powder").material);
  const SolverSetup crust = bridge(find_preset("ice_crust").material);
  Solver soft(best_kernels(), powder), hard(best_kernels(), crust);
  const auto advance = [&](int from, int to) {  // in parts of 0.04 s
    for (int k = from; k <= to; ++k) {
      soft.advance_to(0.04 * k);
      hard.advance_to(0.04 * k);
      curve.add("powder", {0.04 * k, sag(soft, powder)});
      curve.add("ice_crust", {0.04 * k, sag(hard, crust)});
    }
  };
  advance(1, 7);
  CHECK(sag(soft, powder) > 0.1);
  CHECK(sag(hard, crust) < 0.2 * kDx);
  advance(8, 20);
  CHECK(sag(hard, crust) > 0.1);            // it is broken,
  CHECK(kept_together(hard, crust) > 0.4);  // into pieces that are whole
  CHECK(kept_together(soft, powder) < 0.2);
}

// Through one scene of the repository, with balls of 22 particles across: its quick size would take three
// times as long.
TEST_CASE("each preset lasts five seconds of a thrown ball at the automatic dt", "[physics][figure][slow]") {
  Curve curve("five_seconds", "series,time_s,energy");
  for (const std::string& preset : preset_names()) {
    ReadOptions options;
    options.overrides.push_back({"snow.ball.preset", preset});
    options.overrides.push_back({"simulation.particles_across", "22"});
    Solver simulation(best_kernels(),
                      build_simulation(read_scene(FIRN_SOURCE_ROOT "/scenes/snowball_drop.toml", options)));
    const Metrics start = simulation.metrics();
    const auto energy = [](const Metrics& m) {
      return m.kinetic_energy + m.elastic_energy + m.potential_energy;
    };
    INFO(preset);
    Snapshot snapshot;
    for (int i = 1; i <= 50; ++i) {
      REQUIRE(simulation.advance_to(0.1 * i));
      const Metrics now = simulation.metrics();
      INFO("after " << 0.1 * i << " s");
      REQUIRE(std::isfinite(energy(now)));
      REQUIRE(now.mass == Approx(start.mass).epsilon(1e-6));
      REQUIRE(energy(now) < 1.005 * energy(start));
      curve.add(preset, {0.1 * i, energy(now) / energy(start)});
    }
    simulation.snapshot(snapshot);
    bool finite = true, above = true;
    for (std::size_t i = 0; i < snapshot.size(); ++i) {
      const Vec3 x = vec(snapshot.world_position(i)),
                 v(snapshot.velocity[0][i], snapshot.velocity[1][i], snapshot.velocity[2][i]);
      finite = finite && x.allFinite() && v.allFinite() && std::isfinite(snapshot.density[i]);
      above = above && x.y() > -snapshot.dx;  // on the ground, not through it
    }
    CHECK(finite);
    CHECK(above);
    CHECK(simulation.metrics().kinetic_energy < 0.05 * start.kinetic_energy);  // it came to rest
  }
}

}  // namespace firn::test::presets
