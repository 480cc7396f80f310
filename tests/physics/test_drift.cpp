// SPDX-License-Identifier: MIT
// Particles drift through the margin of their blocks until one of them has left it, then all are sorted. A
// sort too few would scatter into a neighbour's tile, so runs at the speed limit are held to the same runs
// sorted before every step, and every particle's place is read before every P2G.
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/mpm/state.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::drift {
namespace {

constexpr double kDx = 0.01;
constexpr std::int32_t kOneCell = kernels::kOneCell;

enum class Sorted { when_needed, before_every_step };

class Run {
 public:
  Run(const kernels::KernelTable& table, const SolverSetup& setup, Sorted sorted)
      : state_(table, setup), sorted_(sorted) {
    place_particles(state_);
    state_.rebuild_grid();
    state_.summarise();
    state_.after_stage = [this](const std::string& stage) {
      if (stage == "sort") count_out_of_reach();
    };
  }

  Solver::State& state() { return state_; }
  int sorts() const { return sorts_; }
  std::size_t out_of_reach() const { return out_of_reach_; }  // at any P2G, particles beyond their tile

  void step(double dt) {
    if (sorted_ == Sorted::before_every_step) {  // into the blocks where the particles are
      state_.sorter.sort(state_.particles, state_.blocks, {}, 0.f);
      state_.rebuild_grid();
      state_.summary.strayed = 0;
    }
    if (state_.summary.strayed) ++sorts_;
    state_.step(dt);
  }

  // Gives every particle of an even (or odd) id the opposite velocity, as no physics would.
  void turn_round(std::uint32_t parity) {
    const kernels::ParticleView p = state_.particles.view();
    for (std::size_t i = 0; i < state_.particles.size(); ++i) {
      if (p.id[i] % 2 != parity) continue;
      for (float* v : p.v) v[i] = -v[i];
      for (float* c : p.C) c[i] = -c[i];
    }
  }

 private:
  void count_out_of_reach() {
    const kernels::ParticleView p = state_.particles.view();
    for (std::size_t i = 0; i < state_.particles.size(); ++i) {
      for (const std::int32_t* x : p.x) out_of_reach_ += x[i] < -kOneCell || x[i] >= 5 * kOneCell;
    }
  }

  Solver::State state_;
  Sorted sorted_;
  int sorts_ = 0;
  std::size_t out_of_reach_ = 0;
};

// The largest differences between two runs, particle by particle.
struct Apart {
  double x = 0;  // cells
  double v = 0;  // m/s
  double f = 0;
};

std::vector<std::size_t> by_id(const kernels::ParticleView& p, std::size_t count) {
  std::vector<std::size_t> at(count);
  for (std::size_t i = 0; i < count; ++i) at[p.id[i]] = i;
  return at;
}

// On each axis, 2^-28 cells from the origin.
std::vector<std::int64_t> places(const Solver::State& s, int axis) {
  std::vector<std::int64_t> out(s.particles.size());
  for (std::size_t b = 0; b < s.blocks.size(); ++b) {
    const std::int64_t block[3] = {s.blocks.coord[b].x, s.blocks.coord[b].y, s.blocks.coord[b].z};
    for (std::size_t i = s.blocks.begin[b]; i < s.blocks.begin[b + 1]; ++i)
      out[i] = 4 * kOneCell * block[axis] + s.particles.view().x[axis][i];
  }
  return out;
}

Apart compare(const Solver::State& a, const Solver::State& b) {
  REQUIRE(a.particles.size() == b.particles.size());
  const kernels::ParticleView p = a.particles.view(), q = b.particles.view();
  const std::vector<std::size_t> in_a = by_id(p, a.particles.size()), in_b = by_id(q, b.particles.size());
  Apart out;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<std::int64_t> x = places(a, axis), y = places(b, axis);
    for (std::size_t id = 0; id < in_a.size(); ++id) {
      const std::size_t i = in_a[id], j = in_b[id];
      out.x = std::max(out.x, static_cast<double>(std::abs(x[i] - y[j])) / kOneCell);
      out.v = std::max<double>(out.v, std::abs(p.v[axis][i] - q.v[axis][j]));
      for (int k = 3 * axis; k < 3 * axis + 3; ++k)
        out.f = std::max<double>(out.f, std::abs(p.F[k][i] - q.F[k][j]));
    }
  }
  return out;
}

// Single particles on 40-cell centres, so that no two meet, in all 26 directions of a block's neighbours,
// each direction from `starts` places of its block.
SolverSetup fan(double speed, int starts) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.gravity = Vec3::Zero();
  setup.check_energy_bound = false;
  PlacedSnow snow;
  snow.material = elastic();
  snow.particle_volume = kDx * kDx * kDx / 8;
  for (int direction = 0; direction < 27; ++direction) {
    const Vec3 way(direction / 9 - 1, direction / 3 % 3 - 1, direction % 3 - 1);
    for (int start = 0; start < starts && direction != 13; ++start) {
      Vec3 x(40 * (direction - 13), 40 * (start % 8 - 4), 40 * (start / 8 - 4));
      for (int axis = 0; axis < 3; ++axis) x[axis] += 4 * uniform_double(hash_keys(direction, start, axis));
      snow.position.push_back(kDx * x);
      snow.velocity.push_back(speed * way.normalized());
    }
  }
  setup.snow.push_back(snow);
  return setup;
}

constexpr double kDt = 1e-4;                 // s
constexpr double kRuleCells = 0.4;           // a step, what the choice of dt allows
constexpr double kMostCells = 0.9999;        // a step, just below what stops the run
constexpr double kCellsPerStep = kDx / kDt;  // m/s

}  // namespace

TEST_CASE("particles that cross block borders at the speed limit, every way and back, are never out of reach",
          "[physics]") {
  for (const kernels::KernelTable* table : supported_kernels()) {
    for (const double cells : {kRuleCells, kMostCells}) {
      const SolverSetup setup = fan(cells * kCellsPerStep, 6);
      Run run(*table, setup, Sorted::when_needed), reference(*table, setup, Sorted::before_every_step);
      if (cells == kRuleCells) CHECK(stable_limit(run.state()).dt == Approx(kDt));
      for (int step = 0; step < 60; ++step) {
        run.step(kDt);
        reference.step(kDt);
        if (hash_keys(step) % 3 != 0) continue;  // turns come at all distances from the last sort
        run.turn_round(step / 2 % 2);
        reference.turn_round(step / 2 % 2);
      }
      INFO(table->isa << ", " << cells << " cells a step, " << run.sorts() << " sorts");
      CHECK(run.out_of_reach() == 0);
      CHECK(reference.out_of_reach() == 0);
      CHECK(run.sorts() > 6);
      CHECK(run.sorts() < 60);
      const Apart apart = compare(run.state(), reference.state());
      // Alone on its nodes, a particle knows no order of summation.
      CHECK(apart.x == 0);
      CHECK(apart.v == 0);
      CHECK(apart.f == 0);
    }
  }
}

TEST_CASE("a spinning elastic ball at the speed limit is what it is when sorted before every step",
          "[physics]") {
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(-1, 1, 0), Vec3(1, -1, -1)}) {
    SolverSetup setup;
    setup.dx = kDx;
    setup.snow.push_back(ball(Vec3(0.013, -0.02, 0.007), 5 * kDx, kDx, elastic(), Vec3::Zero()));
    for (std::size_t i = 0; i < setup.snow[0].position.size(); ++i)
      setup.snow[0].velocity[i] = 40 * way.normalized() + Vec3(30, -50, 20).cross(setup.snow[0].position[i]);
    Run run(best_kernels(), setup, Sorted::when_needed);
    Run reference(best_kernels(), setup, Sorted::before_every_step);
    for (int step = 0; step < 100; ++step) {
      const double dt = stable_limit(run.state()).dt;
      CHECK(dt * std::sqrt(run.state().summary.speed2) == Approx(kRuleCells * kDx));
      run.step(dt);
      reference.step(dt);
    }
    CHECK(run.out_of_reach() == 0);
    CHECK(run.sorts() > 8);
    CHECK(run.sorts() < 40);
    const Apart apart = compare(run.state(), reference.state());
    CHECK(apart.x < 2e-5);  // round-off of sums in another order: 5e-6, 3e-5 and 3e-6
    CHECK(apart.v < 1e-4);
    CHECK(apart.f < 1e-5);
  }
}

TEST_CASE("a particle that crosses a cell or more in one step stops the run, and the run stays stopped",
          "[physics]") {
  for (const double cells : {1.0001, 2.5, 7.0, 20.0, 1e12}) {
    Solver simulation(best_kernels(), fan(cells * kCellsPerStep, 1));
    INFO(cells << " cells a step");
    for (int again = 0; again < 3; ++again)
      CHECK_THROWS_WITH(simulation.step(kDt), contains("cells in one step"));
  }
}

TEST_CASE("a force that moves snow by more than a cell in its first step stops the run", "[physics]") {
  SolverSetup setup = fan(0, 1);
  setup.gravity = Vec3(0, 1.5 * kDx / (kDt * kDt), 0);
  Solver simulation(best_kernels(), setup);
  CHECK_THROWS_WITH(simulation.step(kDt), contains("crosses 1.5 cells in one step"));
  CHECK_THROWS_WITH(simulation.step(kDt), contains("crosses 1.5 cells in one step"));
}

}  // namespace firn::test::drift
