// SPDX-License-Identifier: MIT
// Colliders that move: they push, carry, press and wake snow, and where they are is a function of time alone.
#include <sstream>
#include <string>

#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::moving {
namespace {

constexpr double kDx = 0.02;

Collider box(const std::string& name, const Vec3& center, const Vec3& size, std::vector<MotionKey> keys) {
  Collider c;
  c.name = name;
  c.shape = {Box{0.5 * size}, {Mat3::Identity(), center}};
  c.friction = 0.3;
  c.motion = Motion(std::move(keys), center);
  return c;
}

MotionKey at(double time, const Vec3& shift, double degrees_about_z = 0) {
  return {time, shift, Eigen::AngleAxisd(degrees_about_z * M_PI / 180, Vec3::UnitZ()).toRotationMatrix()};
}

SolverSetup on_ground(double friction) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.colliders.push_back(plane(Vec3(0, 0.5 * kDx, 0), Vec3(0, 1, 0), Contact::separating, friction));
  return setup;
}

// 16 x 6 x 16 cells, a little packed by their fall, at rest and asleep after half a second.
SolverSetup bed() {
  SolverSetup setup = on_ground(0.5);
  setup.snow.push_back(
      fill(Vec3(-8 * kDx, 4 * kDx, -8 * kDx), Vec3(8 * kDx, 10 * kDx, 8 * kDx), kDx, 2, Material{}));
  return setup;
}

// A bed, and a tilting foot that from 0.9 s on is pressed 3 cells deep into it and lifted again.
SolverSetup pressed_bed() {
  SolverSetup setup = bed();
  const Vec3 center(0, 12 * kDx, 0);
  setup.colliders.push_back(box("foot", center, Vec3(6, 4, 6) * kDx,
                                {at(0.9, Vec3::Zero()), at(1.1, Vec3(0, -6.5 * kDx, 0), 4),
                                 at(1.2, Vec3(0, -6.5 * kDx, 0)), at(1.4, Vec3::Zero())}));
  return setup;
}

double deepest_inside(const Solver& simulation, const Collider& collider) {
  const Shape shape{collider.shape.form, collider.motion.pose(collider.shape.pose, simulation.time())};
  Snapshot snapshot;
  simulation.snapshot(snapshot);
  double deepest = 0;
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    deepest = std::max(deepest, -signed_distance(shape, vec(snapshot.world_position(i))));
  }
  return deepest;
}

double share_asleep(const Solver& simulation) {
  const Metrics m = simulation.metrics();
  return static_cast<double>(m.particles_asleep) / static_cast<double>(m.particles);
}

// Mean density and top of the snow under the foot.
struct Under {
  double density = 0, top = 0;
};
Under under_foot(const Solver& simulation) {
  Snapshot snapshot;
  simulation.snapshot(snapshot);
  Under under;
  int count = 0;
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    const Vec3 x = vec(snapshot.world_position(i));
    if (std::max(std::abs(x.x()), std::abs(x.z())) > 2 * kDx) continue;
    under.density += snapshot.density[i];
    under.top = std::max(under.top, x.y());
    ++count;
  }
  under.density /= count;
  return under;
}

}  // namespace

TEST_CASE("a wall that moves pushes a block of snow ahead at its own speed", "[physics]") {
  const double speed = 0.8;
  SolverSetup setup = on_ground(0.4);
  setup.snow.push_back(fill(Vec3(0, 0.5 * kDx, 0), Vec3(8 * kDx, 6.5 * kDx, 8 * kDx), kDx, 2, elastic()));
  setup.colliders.push_back(box("wall", Vec3(-2, 5, 4) * kDx, Vec3(3, 10, 12) * kDx,
                                {at(0, Vec3::Zero()), at(1, Vec3(speed, 0, 0))}));
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.5);
  const double before = bounds_of(simulation.metrics()).center().x();
  simulation.advance_to(0.9);
  const Metrics m = simulation.metrics();
  CHECK((bounds_of(m).center().x() - before) / 0.4 == Approx(speed).epsilon(0.02));
  CHECK(vec(m.momentum).x() / m.mass == Approx(speed).epsilon(0.05));
  CHECK(deepest_inside(simulation, setup.colliders[1]) < 0.5 * kDx);
}

TEST_CASE("a sticky plate that is lifted and turned carries the snow on it along", "[physics]") {
  SolverSetup setup;
  setup.dx = kDx;
  setup.snow.push_back(fill(Vec3(0, 0.5 * kDx, 0), Vec3(6 * kDx, 4.5 * kDx, 6 * kDx), kDx, 2, elastic()));
  setup.colliders.push_back(box("plate", Vec3(3, -1.5, 3) * kDx, Vec3(12, 4, 12) * kDx,
                                {at(0.2, Vec3::Zero()), at(1.0, Vec3(0, 0.4, 0), 60)}));
  setup.colliders[0].contact = Contact::sticky;
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.2);
  const Pose start = setup.colliders[0].motion.pose(setup.colliders[0].shape.pose, 0.2);
  const Vec3 local = start.to_local(bounds_of(simulation.metrics()).center());
  simulation.advance_to(1.1);
  const Pose end = setup.colliders[0].motion.pose(setup.colliders[0].shape.pose, 1.1);
  CHECK((bounds_of(simulation.metrics()).center() - end.to_world(local)).norm() < kDx);
  CHECK(bounds_of(simulation.metrics()).center().y() > 0.35);
}

TEST_CASE("a box that presses into a bed wakes it, packs it and leaves its imprint", "[physics]") {
  Solver simulation(best_kernels(), pressed_bed());
  simulation.advance_to(0.89);
  CHECK(share_asleep(simulation) == 1);
  const Under before = under_foot(simulation);
  simulation.advance_to(0.92);
  CHECK(share_asleep(simulation) < 0.9);
  simulation.advance_to(1.2);
  CHECK(deepest_inside(simulation, pressed_bed().colliders[1]) < 1.5 * kDx);  // along its sharp edges
  simulation.advance_to(2.3);
  const Under after = under_foot(simulation);
  INFO("density " << before.density << " to " << after.density << ", top " << before.top << " to "
                  << after.top);
  CHECK(after.top < before.top - 1.5 * kDx);
  CHECK(after.density > 1.15 * before.density);
  CHECK(share_asleep(simulation) == 1);  // the foot hangs above and moves no more
}

TEST_CASE("snow that sleeps on a floor falls when the floor is drawn away", "[physics]") {
  SolverSetup setup = bed();
  setup.colliders[0] = box("floor", Vec3(0, -1.5 * kDx, 0), Vec3(30, 4, 30) * kDx,
                           {at(0.8, Vec3::Zero()), at(1.0, Vec3(0, -2, 0))});
  Solver simulation(best_kernels(), setup);
  simulation.advance_to(0.79);
  CHECK(share_asleep(simulation) == 1);
  const double height = bounds_of(simulation.metrics()).center().y();
  simulation.advance_to(1.1);
  CHECK(share_asleep(simulation) == 0);
  CHECK(height - bounds_of(simulation.metrics()).center().y() ==
        Approx(0.5 * 9.81 * 0.3 * 0.3).epsilon(0.05));
}

TEST_CASE("a fast box does not pass through snow, and its speed limits the step", "[physics]") {
  SolverSetup setup = bed();
  setup.colliders.push_back(box("ram", Vec3(-15, 6, 0) * kDx, Vec3(8, 11, 30) * kDx,
                                {at(0, Vec3::Zero()), at(0.08, Vec3(0.4, 0, 0))}));
  Solver simulation(best_kernels(), setup);
  double deepest = 0;
  for (int k = 1; k <= 10; ++k) {
    simulation.advance_to(0.01 * k);
    deepest = std::max(deepest, deepest_inside(simulation, setup.colliders[1]));
  }
  const double hindmost = bounds_of(simulation.metrics()).min.x(), face = 9 * kDx;
  INFO(deepest / kDx << " cells, " << (hindmost - face) / kDx << " before the face");
  CHECK(deepest < 0.5 * kDx);
  CHECK(hindmost > face - 0.5 * kDx);

  setup.colliders[1].motion = Motion({at(0, Vec3::Zero()), at(1, Vec3(400, 0, 0))}, Vec3::Zero());
  const TimeStep step = Solver(best_kernels(), setup).stable_step();
  CHECK(400 * step.dt <= 0.25 * kDx * (1 + 1e-9));
  CHECK(step.cause == "collider speed (ram, 400 m/s)");
}

TEST_CASE("with moving colliders the bits are the same for 1, 2 and 4 threads on v3 and v4",
          "[physics][slow]") {
  std::uint64_t expected = 0;
  with_kernels_and_threads({1, 2, 4}, [&](const kernels::KernelTable& table) {
    Solver simulation(table, pressed_bed());
    simulation.advance_to(1.05);
    const std::uint64_t hash = simulation.state_hash();
    if (expected == 0) expected = hash;
    CHECK(hash == expected);
  });
}

TEST_CASE("a simulation saved while a collider moves continues bit for bit", "[physics]") {
  Solver whole(best_kernels(), pressed_bed());
  for (const double time : {0.7, 0.913, 1.0, 1.15, 1.3}) {
    whole.advance_to(time);
    std::stringstream saved;
    whole.save(saved);
    Solver second(best_kernels(), pressed_bed());
    second.load(saved);
    whole.advance_to(time + 0.03);
    second.advance_to(time + 0.03);
    INFO(time);
    CHECK(second.state_hash() == whole.state_hash());
    CHECK(second.metrics().particle_steps == whole.metrics().particle_steps);
  }
}

}  // namespace firn::test::moving
