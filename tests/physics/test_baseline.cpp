// SPDX-License-Identifier: MIT
// The benchmark's baseline computes what firn computes: otherwise their ratio would say nothing.
#include <algorithm>

#include "bench/naive.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::baseline {
namespace {

constexpr double kDx = 1.0 / 128;

// A ball that comes down aslant, hits the floor within the first steps and packs.
SolverSetup ball_hits_floor() {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(ball(Vec3(0.011, 0.055, -0.007), 0.05, kDx, Material{}, Vec3(2, -10, 1)));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3::UnitY(), Contact::separating, 0.5));
  return setup;
}

struct Comparison {
  Vec3 mean_x[2], mean_v[2];           // m and m/s: firn, baseline
  std::vector<double> apart, v_apart;  // cells and m/s, one a particle, ascending
};

Comparison compare(const Solver& simulation, const bench::NaiveSimulation& naive) {
  Snapshot snapshot;
  simulation.snapshot(snapshot);
  std::vector<const bench::NaiveParticle*> of_id(naive.particles().size());
  for (const bench::NaiveParticle& p : naive.particles()) of_id[p.id] = &p;
  Comparison out;
  for (int side : {0, 1}) out.mean_x[side] = out.mean_v[side] = Vec3::Zero();
  const double weight = 1.0 / static_cast<double>(snapshot.size());
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    const bench::NaiveParticle& p = *of_id[snapshot.id[i]];
    const Vec3 x[2] = {vec(snapshot.world_position(i)), kDx * Vec3(p.x[0], p.x[1], p.x[2])};
    const Vec3 v[2] = {{snapshot.velocity[0][i], snapshot.velocity[1][i], snapshot.velocity[2][i]},
                       {p.v[0], p.v[1], p.v[2]}};
    for (int side : {0, 1}) {
      out.mean_x[side] += weight * x[side];
      out.mean_v[side] += weight * v[side];
    }
    out.apart.push_back((x[0] - x[1]).norm() / kDx);
    out.v_apart.push_back((v[0] - v[1]).norm());
  }
  std::sort(out.apart.begin(), out.apart.end());
  std::sort(out.v_apart.begin(), out.v_apart.end());
  return out;
}

}  // namespace

TEST_CASE("the naive baseline of the benchmark moves snow as firn does", "[physics]") {
  const SolverSetup setup = ball_hits_floor();
  for (const bool stop_early : {true, false}) {
    Solver simulation(best_kernels(), setup);
    bench::NaiveSimulation naive(setup, stop_early);
    REQUIRE(naive.particles().size() == simulation.particle_count());
    for (int step = 0; step < 100; ++step) {
      simulation.step(3e-5);
      naive.step(3e-5f);
    }
    const Comparison c = compare(simulation, naive);
    // The ball has slowed down and most of it yields; both sides round in float.
    CHECK(c.mean_v[0].y() > -6);
    CHECK(2 * naive.clamped() > naive.particles().size());
    CHECK((c.mean_x[0] - c.mean_x[1]).norm() < 1e-5 * kDx);
    CHECK((c.mean_v[0] - c.mean_v[1]).norm() < 2e-4);
    CHECK(c.apart.back() < 1e-4);
    CHECK(c.v_apart.back() < 1e-3);
  }
}

}  // namespace firn::test::baseline
