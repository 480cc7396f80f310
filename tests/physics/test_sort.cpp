// SPDX-License-Identifier: MIT
// The order of particles between two sorts: the transfers load and flush a cell once for each run of its
// particles, so runs have to stay long while snow drifts from cell to cell.
#include <array>
#include <set>
#include <vector>

#include "src/core/rng.h"
#include "src/mpm/state.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::sort {
namespace {

constexpr double kDx = 0.01;  // m
constexpr int kSide = 16;     // cells

// Eight particles a cell, each anywhere in its own eighth.
SolverSetup moving_cube(const Vec3& velocity) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.sleep = false;
  PlacedSnow snow;
  snow.name = "snow";
  snow.particle_volume = kDx * kDx * kDx / 8;
  for (int n = 0; n < 8 * kSide * kSide * kSide; ++n) {
    Vec3 x(n / (4 * kSide * kSide), n / (2 * kSide) % (2 * kSide), n % (2 * kSide));
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] += uniform_double(hash_keys(static_cast<std::uint64_t>(n), static_cast<std::uint64_t>(axis)));
    }
    snow.position.push_back(kDx / 2 * x);
    snow.velocity.push_back(velocity);
  }
  setup.snow.push_back(std::move(snow));
  return setup;
}

// Runs for each cell that a block's particles lie in, `cells` (on each axis) after where they are stored.
double runs_per_cell(const Solver::State& state, const std::int32_t (&ahead)[3]) {
  const kernels::ParticleView p = state.particles.view();
  std::size_t runs = 0, cells = 0;
  for (std::size_t b = 0; b < state.blocks.size(); ++b) {
    std::set<std::array<int, 3>> seen;
    std::array<int, 3> last{-100, 0, 0};
    for (std::size_t i = state.blocks.begin[b]; i < state.blocks.begin[b + 1]; ++i) {
      std::array<int, 3> cell;
      for (int axis = 0; axis < 3; ++axis) cell[axis] = (p.x[axis][i] + ahead[axis]) >> kernels::kCellBits;
      runs += cell != last;
      seen.insert(cell);
      last = cell;
    }
    cells += seen.size();
  }
  return static_cast<double>(runs) / static_cast<double>(cells);
}

}  // namespace

TEST_CASE("cells stay runs of particles while snow drifts", "[physics]") {
  struct Case {
    Vec3 along;   // m/s
    double most;  // runs a cell
  };
  for (const auto& [along, most] :
       {Case{Vec3(5, 0, 0), 1.25}, Case{Vec3(0, -5, 0), 1.25}, Case{Vec3(0, 0, 5), 1.25},
        Case{Vec3(4, -2, 0), 2.3}, Case{Vec3(0, -4, -2), 2.3}}) {
    INFO("velocity " << along.transpose() << " m/s");
    Solver::State state(best_kernels(), moving_cube(along));
    place_particles(state);
    state.rebuild_grid();
    state.summarise();
    state.sort();
    double sum = 0;
    constexpr int kPlaces = 13;  // from one side of the margin to the other
    for (int k = 0; k < kPlaces; ++k) {
      std::int32_t ahead[3];
      for (int axis = 0; axis < 3; ++axis) {
        ahead[axis] = static_cast<std::int32_t>(along[axis] / along.norm() * 1.5 * k / (kPlaces - 1) *
                                                kernels::kOneCell);
      }
      sum += runs_per_cell(state, ahead);
    }
    CHECK(sum / kPlaces < most);
  }
}

}  // namespace firn::test::sort
