// SPDX-License-Identifier: MIT
// Memory follows the snow: thin snow along a slope costs by the particle, however long the slope and whatever
// box lies around it, from seeding on.
#include <algorithm>
#include <fstream>
#include <string>

#include "src/mpm/state.h"
#include "src/scene/emit.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::memory {
namespace {

constexpr double kDx = 0.05;  // m

// A sheet of snow two cells thick and eight wide, down a slope of 30 degrees that heads aslant through the
// axes: the box around 100 m of it holds 1.5 billion cells.
SolverSetup slope(double length) {
  Shape sheet;
  sheet.form = Box{Vec3(length / 2, 0.05, 0.2)};
  sheet.pose.rotation =
      (Eigen::AngleAxisd(0.7, Vec3::UnitY()) * Eigen::AngleAxisd(-M_PI / 6, Vec3::UnitZ())).matrix();
  SolverSetup setup;
  setup.dx = kDx;
  PlacedSnow snow;
  snow.position = fill_shape(sheet, kDx / 2, 1);
  snow.velocity.assign(snow.position.size(), sheet.pose.rotation * Vec3(8, 0, 0));
  snow.particle_volume = kDx * kDx * kDx / 8;
  setup.snow.push_back(std::move(snow));
  setup.colliders.push_back(plane(sheet.pose.rotation * Vec3(0, -0.06, 0),
                                  sheet.pose.rotation * Vec3::UnitY(), Contact::separating, 0.3));
  return setup;
}

// A line of /proc/self/status in bytes: VmRSS is what the process holds, VmHWM the most since the last reset.
double status_bytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name + ":")) return 1024 * std::stod(line.substr(name.size() + 1));
  }
  return 0;
}

struct Cost {
  std::size_t particles;
  double resident;  // bytes a particle after some steps and sorts
  double most;      // bytes a particle that the process grew by meanwhile, seeding included
};

Cost cost_of(double length) {
  std::ofstream("/proc/self/clear_refs") << 5;  // resets VmHWM
  const double before = status_bytes("VmRSS");
  Solver simulation(best_kernels(), slope(length));
  for (int step = 0; step < 30; ++step) simulation.step(5e-4);
  const auto particles = static_cast<double>(simulation.particle_count());
  return {simulation.particle_count(), static_cast<double>(simulation.resident_bytes()) / particles,
          (status_bytes("VmHWM") - before) / particles};
}

}  // namespace

TEST_CASE("snow along a slope takes memory by the particle, not by the box around it", "[physics]") {
  const Cost small = cost_of(25), large = cost_of(100);
  INFO(small.resident << " and " << large.resident << " bytes a particle, at most " << large.most);
  CHECK(large.particles == 4 * small.particles);
  // 140 in compact snow; the rest is the ring of blocks around a sheet so thin, and the slope beneath it.
  CHECK(large.resident < 400);
  CHECK(large.resident < 1.05 * small.resident);
  // A byte a cell of the box would be 5700.
  CHECK(large.most < 2000);
}

TEST_CASE("snow as placed is given back once it is in the columns", "[physics]") {
  Solver::State state(best_kernels(), slope(5));
  state.setup.snow[0].packing.assign(state.setup.snow[0].position.size(), 1.f);
  place_particles(state);
  CHECK(state.setup.snow[0].position.capacity() == 0);
  CHECK(state.setup.snow[0].velocity.capacity() == 0);
  CHECK(state.setup.snow[0].packing.capacity() == 0);
}

}  // namespace firn::test::memory
