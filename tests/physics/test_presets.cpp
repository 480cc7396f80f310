// SPDX-License-Identifier: MIT
// Every preset through one scene of the repository, at its quick size, for five seconds at the automatic dt.
#include <cmath>

#include "src/scene/presets.h"
#include "src/scene/scene.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

using namespace firn;
using namespace firn::test;

TEST_CASE("each preset lasts five seconds of a thrown ball at the automatic dt", "[physics]") {
  for (const std::string& preset : preset_names()) {
    ReadOptions options;
    options.quick = true;
    options.overrides.push_back({"snow.ball.preset", preset});
    Simulation simulation(
        best_kernels(), build_simulation(read_scene(FIRN_SOURCE_ROOT "/scenes/snowball_drop.toml", options)));
    const Metrics start = simulation.metrics();
    const auto energy = [](const Metrics& m) {
      return m.kinetic_energy + m.elastic_energy + m.potential_energy;
    };
    INFO(preset);
    Snapshot snapshot;
    for (int i = 1; i <= 50; ++i) {
      REQUIRE(simulation.advance_to(0.1 * i, kNeverStop));
      const Metrics now = simulation.metrics();
      INFO("after " << 0.1 * i << " s");
      REQUIRE(std::isfinite(energy(now)));
      REQUIRE(now.mass == Approx(start.mass).epsilon(1e-6));
      REQUIRE(energy(now) < 1.005 * energy(start));
    }
    simulation.snapshot(snapshot);
    bool finite = true, above = true;
    for (std::size_t i = 0; i < snapshot.size(); ++i) {
      const Vec3 x = snapshot.world_position(i), v(snapshot.v[0][i], snapshot.v[1][i], snapshot.v[2][i]);
      finite = finite && x.allFinite() && v.allFinite() && std::isfinite(snapshot.density[i]);
      above = above && x.y() > -snapshot.dx;  // on the ground, not through it
    }
    CHECK(finite);
    CHECK(above);
    CHECK(simulation.metrics().kinetic_energy < 0.05 * start.kinetic_energy);  // it came to rest
  }
}
