// SPDX-License-Identifier: MIT
// A ball of snow rolls down a snowy slope and grows: what it presses on comes off the ground with it. The
// snows are those of scenes/rolling_ball.toml.
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::rolling {
namespace {

constexpr double kDx = 0.03;
constexpr double kRadius = 0.15, kLayer = 0.06;  // m
constexpr double kTilt = 30 * M_PI / 180;
constexpr double kSpeed = 1.2;  // m/s, at the start, rolling

Material pressed_ball() {
  Material m = find_preset("wet").material;
  m.young_modulus = 1e6;
  m.critical_stretch = 0.03;
  return m;
}

Material sticky_layer() {
  Material m = find_preset("wet").material;
  m.density = 150;
  m.young_modulus = 1e4;
  m.critical_stretch = 0.02;
  m.hardening = 5;
  return m;
}

SolverSetup slope(const Material& layer, double dx = kDx) {
  SolverSetup setup;
  setup.dx = dx;
  setup.gravity = 9.81 * Vec3(std::sin(kTilt), -std::cos(kTilt), 0);
  const Vec3 center(0.3, kLayer + kRadius, 0);
  PlacedSnow snow = ball(center, kRadius, dx, pressed_ball(), Vec3(kSpeed, 0, 0));
  for (std::size_t i = 0; i < snow.position.size(); ++i)
    snow.velocity[i] += Vec3(0, 0, -kSpeed / kRadius).cross(snow.position[i] - center);
  setup.snow.push_back(std::move(snow));
  setup.snow.push_back(fill(Vec3(0, 0, -0.27), Vec3(2.4, kLayer, 0.27), dx, 2, layer));
  setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0, 1, 0), Contact::separating, 1.0));
  return setup;
}

struct Rolling {
  Vec3 center = Vec3::Zero(), velocity = Vec3::Zero();  // of the ball as it was placed
  double spin = 0;                                      // rad/s, down the slope
  double grown = 0;  // mass of the layer that moves with the ball, over the ball's
};

// The layer's particles that go with the ball: near it, lifted off where they lay, and in its rigid motion to
// 0.4 of its speed. Snow that it pushes aside or throws up does not count.
Rolling rolling(const Solver& simulation, double ball_mass, const Material& layer) {
  Snapshot s;
  simulation.snapshot(s);
  Rolling r;
  double count = 0, moment = 0, inertia = 0, gathered = 0;
  const auto velocity = [&](std::size_t i) {
    return Vec3(s.velocity[0][i], s.velocity[1][i], s.velocity[2][i]);
  };
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s.object[i] != 0) continue;
    ++count;
    r.center += vec(s.world_position(i));
    r.velocity += velocity(i);
  }
  r.center /= count;
  r.velocity /= count;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s.object[i] != 0) continue;
    const Vec3 x = vec(s.world_position(i)) - r.center, v = velocity(i) - r.velocity;
    moment += x.x() * v.y() - x.y() * v.x();
    inertia += x.x() * x.x() + x.y() * x.y();
  }
  r.spin = -moment / inertia;
  for (std::size_t i = 0; i < s.size(); ++i) {
    if (s.object[i] != 1) continue;
    const Vec3 x = vec(s.world_position(i)) - r.center;
    const Vec3 with_ball = r.velocity + Vec3(0, 0, -r.spin).cross(x);
    const bool lifted = vec(s.world_position(i)).y() > kLayer + 0.5 * kDx;
    if (x.norm() < 1.8 * kRadius && lifted && (velocity(i) - with_ball).norm() < 0.4 * r.velocity.norm())
      gathered += s.volume0[i] * layer.density;
  }
  r.grown = gathered / ball_mass;
  return r;
}

double mass(const PlacedSnow& snow) {
  return static_cast<double>(snow.position.size()) * snow.particle_mass();
}

}  // namespace

TEST_CASE("a ball that rolls down a slope of sticky snow winds it up and grows by a quarter in 1.4 m",
          "[physics][figure]") {
  const SolverSetup setup = slope(sticky_layer());
  Solver simulation(best_kernels(), setup);
  Rolling last;
  Curve curve("rolling_sticky", "series,way_m,grown,rolls");
  for (const double time : {0.3, 0.6, 0.9}) {
    for (int part = 5; part >= 0; --part) {
      simulation.advance_to(time - 0.05 * part);
      const Rolling r = rolling(simulation, mass(setup.snow[0]), sticky_layer());
      curve.add("sticky layer", {r.center.x() - setup.snow[0].position[0].x(), r.grown,
                                 r.spin * r.center.y() / r.velocity.x()});
    }
    const Rolling now = rolling(simulation, mass(setup.snow[0]), sticky_layer());
    // It rolls on the bare ground under it: its centre moves at the spin times the height, to 15 %.
    INFO(time << " s, at " << now.center.x() << " m, " << now.velocity.x() << " m/s, grown " << now.grown);
    CHECK(now.spin * now.center.y() / now.velocity.x() == Approx(1).margin(0.15));
    CHECK(now.velocity.x() > 0.8 * kSpeed);
    CHECK(now.grown > last.grown + 0.05);
    last = now;
  }
  CHECK(last.center.x() < 0.3 + 1.4);
  CHECK(last.grown > 0.25);
  if (!makes_figures()) return;
  Solver finer(best_kernels(), slope(sticky_layer(), kDx / 2));
  for (int k = 1; k <= 18; ++k) {
    finer.advance_to(0.05 * k);
    const Rolling r = rolling(finer, mass(setup.snow[0]), sticky_layer());
    curve.add("half the cell", {r.center.x() - setup.snow[0].position[0].x(), r.grown,
                                r.spin * r.center.y() / r.velocity.x()});
  }
}

TEST_CASE(
    "a ball that rolls down a slope of powder, or of the same layer without cohesion, gathers next to "
    "nothing",
    "[physics][figure][slow]") {
  Material crumbly = sticky_layer();
  crumbly.critical_stretch = 0.001;
  Curve curve("rolling_loose", "series,way_m,grown,rolls");
  for (const Material& layer : {find_preset("powder").material, crumbly}) {
    const SolverSetup setup = slope(layer);
    Solver simulation(best_kernels(), setup);
    for (int k = 1; k <= 18; ++k) {  // some is thrown up and falls again
      simulation.advance_to(0.05 * k);
      const Rolling r = rolling(simulation, mass(setup.snow[0]), layer);
      CHECK(r.grown < 0.1);
      curve.add(
          layer.model == kKindOf<kernels::Snow> ? "no cohesion" : "powder",
          {r.center.x() - setup.snow[0].position[0].x(), r.grown, r.spin * r.center.y() / r.velocity.x()});
    }
    CHECK(rolling(simulation, mass(setup.snow[0]), layer).grown < 0.05);
  }
}

}  // namespace firn::test::rolling
