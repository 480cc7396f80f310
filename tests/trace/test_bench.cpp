// SPDX-License-Identifier: MIT
// The scenes and frames of `firn-bench trace`.
#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/trace_frame.h"
#include "bench/trace_scene.h"
#include "bench/tracer_firn.h"
#include "firn/error.h"
#include "src/core/isa.h"
#include "tests/catch.h"

using namespace firn;
using namespace firn::bench;

TEST_CASE("bench scenes have the particles they were asked for, the same in either order") {
  for (const char* shape : {"ball", "slab"}) {
    const Snapshot lattice = trace_scene(shape, "lattice", 20000).snapshot;
    const Snapshot blocks = trace_scene(shape, "blocks", 20000).snapshot;
    REQUIRE(std::fabs(static_cast<double>(lattice.size()) / 20000 - 1) < 0.05);
    REQUIRE(blocks.size() == lattice.size());
    REQUIRE(blocks.id != lattice.id);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      for (int a = 0; a < 3; ++a) REQUIRE(blocks.position[a][i] == lattice.position[a][blocks.id[i]]);
    }
  }
  CHECK_THROWS_AS(trace_scene("cone", "blocks", 1000), Error);
  CHECK_THROWS_AS(trace_scene("ball", "shuffled", 1000), Error);
}

TEST_CASE("a bench frame sees the disc of the ball, and shadow and bounce rays start from what it sees") {
  const TraceScene scene = trace_scene("ball", "blocks", 20000);
  FirnTracer tracer(scene.snapshot, 0.6, choose_kernels("auto"));
  TraceFrame frame(scene, 0);
  const FrameTally tally = frame.render(tracer);
  const RayTally &primary = tally.rays[0], &shadow = tally.rays[1], &bounce = tally.rays[2];
  // The outline of a ball of radius R at distance D is a cone of half angle asin(R / D), sin 20 degrees
  // / 1.08.
  const double tangent = std::tan(std::asin(std::sin(M_PI / 9) / 1.08)) / std::tan(M_PI / 9);
  const double disc = M_PI * std::pow(tangent * kFilmHeight / 2, 2);
  CHECK(primary.rays == std::size_t{kFilmWidth} * kFilmHeight);
  // Balls stick out of it by their radius and their jitter at most.
  const double radius = std::cbrt(3 * 20000 / (4 * M_PI));
  const auto hits = static_cast<double>(primary.hits);
  CHECK(hits > 0.99 * disc);
  CHECK(hits < std::pow((radius + 0.6 + 0.25 * std::sqrt(3)) / radius, 2) * disc);
  CHECK(bounce.rays == primary.hits);
  // Somewhat more than the lit half of the disc faces the light; rough snow sends bounce rays into itself.
  CHECK(shadow.rays > primary.hits / 2);
  CHECK(shadow.rays < primary.hits);
  CHECK(bounce.hits > bounce.rays / 10);
  CHECK(bounce.hits < bounce.rays * 6 / 10);
  CHECK(tally.frame >= tally.interactive);
  CHECK(tally.interactive >= tally.build);
}
