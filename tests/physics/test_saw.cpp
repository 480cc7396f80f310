// SPDX-License-Identifier: MIT
// Propagation saw test: a long column of a slab on a weak layer that collapses is cut along the layer until a
// crack runs by itself. On flat ground the slab falls behind it, and the crack stays slower than shear waves
// in the slab, c_s; where the slope is steeper than the friction of the broken layer the slab is also pulled
// along, and a second crack runs off ahead of the first, at up to 1.6 c_s (Trottet et al. 2022, "Transition
// from sub-Rayleigh anticrack to supershear crack propagation in snow avalanches", Nature Physics 18).
//
// Up the slope is +x. The column is two cells wide between slip walls; its ends are free.
#include <algorithm>
#include <cmath>
#include <vector>

#include "src/mpm/state.h"
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/physics/snow.h"

namespace firn::test::saw {
namespace {

constexpr double kDx = 0.05, kFloor = 0.55 * kDx;  // m; just above a row of nodes, which holds the layer
constexpr double kLayer = 3 * kDx, kSlab = 10 * kDx;
constexpr double kLoading = 0.3;  // s in which gravity comes on: seven swings of the slab on the layer
constexpr double kSaw = 4;        // m/s
constexpr double kAhead = 0.5;    // m; a crack so far ahead of the saw runs by itself
constexpr double kNever = HUGE_VAL;

Material slab() { return find_preset("dry_slab").material; }

// The preset bears the slab when its weight comes on at once. Here it comes slowly, and the layer is near
// failure, as where cracks run in nature.
Material weak_layer() {
  Material m = find_preset("weak_layer").material;
  m.compressive_strength = 1e4;
  return m;
}

SolverSetup column(double length) {
  SolverSetup setup;
  setup.dx = kDx;
  setup.sleep = false;
  setup.gravity = Vec3::Zero();
  const auto layer = [&](double low, double thickness, const Material& material) {
    setup.snow.push_back(fill(Vec3(0, 0, 0.5 * kDx), Vec3(length, thickness, 2.5 * kDx), kDx, 2, material));
    for (Vec3& x : setup.snow.back().position) x.y() += low;
  };
  layer(kFloor + kLayer, kSlab, slab());
  layer(kFloor, kLayer, weak_layer());
  setup.colliders.push_back(plane(Vec3(0, kFloor, 0), Vec3(0, 1, 0), Contact::sticky, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 0.5 * kDx), Vec3(0, 0, 1), Contact::slip, 0));
  setup.colliders.push_back(plane(Vec3(0, 0, 2.5 * kDx), Vec3(0, 0, -1), Contact::slip, 0));
  return setup;
}

class SawTest {
 public:
  SawTest(double degrees, double length)
      : down_(Vec3(-std::sin(degrees * M_PI / 180), -std::cos(degrees * M_PI / 180), 0)),
        state_(best_kernels(), column(length)),
        broken_at_(static_cast<std::size_t>(std::lround(length / kDx)), kNever) {
    state_.budget.top = length;
    place_particles(state_);
    state_.rebuild_grid();
    state_.summarise();
    for_each([&](std::uint32_t id, const Vec3& x, std::size_t) {
      if (id >= placed_.size()) placed_.resize(id + 1);
      placed_[id] = x;
    });
  }

  void load() {
    while (state_.time < kLoading) step();
  }
  void wait(double seconds) {
    for (const double end = state_.time + seconds; state_.time < end;) step();
  }
  // Saws until a crack runs ahead, then waits until it has come to the end, or `patience` (s) is over.
  void saw(double patience) {
    for (const double end = state_.time + patience; state_.time < end && broken() < broken_at_.size();) {
      if (!runs_) cut_ = kSaw * (state_.time - kLoading);
      step();
      take_cohesion();
      const auto ahead = static_cast<std::size_t>((cut_ + kAhead) / kDx);
      runs_ = runs_ || (ahead < broken_at_.size() && broken_at_[ahead] < kNever);
    }
  }

  double critical_length() const { return runs_ ? cut_ : kNever; }  // m
  std::size_t broken() const {                                      // columns of cells
    return static_cast<std::size_t>(
        std::count_if(broken_at_.begin(), broken_at_.end(), [](double t) { return t < kNever; }));
  }
  bool all_broken() const { return broken() == broken_at_.size(); }
  double broken_at(double x) const { return broken_at_[static_cast<std::size_t>(x / kDx)] - kLoading; }  // s

  // m/s, the fit of place against time between two places along the column.
  double crack_speed(double from, double to) const {
    double n = 0, t = 0, x = 0, tt = 0, tx = 0;
    for (std::size_t c = 0; c < broken_at_.size(); ++c) {
      const double at = (static_cast<double>(c) + 0.5) * kDx, when = broken_at_[c];
      if (at < from || at >= to) continue;
      n += 1, t += when, x += at, tt += when * when, tx += when * at;
    }
    return (n * tx - t * x) / (n * tt - t * t);
  }

  // Of the slab between two places: mean way (m) since it was placed and mean velocity (m/s).
  struct Part {
    Vec3 way = Vec3::Zero(), velocity = Vec3::Zero();
  };
  Part part(double from, double to) const {
    Part sum;
    double count = 0;
    for_each([&](std::uint32_t id, const Vec3& x, std::size_t i) {
      const auto p = state_.particles.view();
      if (p.object[i] != 0 || placed_[id].x() < from || placed_[id].x() >= to) return;
      sum.way += x - placed_[id];
      sum.velocity += Vec3(p.v[0][i], p.v[1][i], p.v[2][i]);
      ++count;
    });
    return {sum.way / count, sum.velocity / count};
  }

 private:
  void step() {
    const double part = std::min(state_.time / kLoading, 1.0);
    state_.setup.gravity = 9.81 * 0.5 * (1 - std::cos(M_PI * part)) * down_;
    state_.step(0.9 * stable_limit(state_).dt);
    note_broken();
  }

  template <class F>
  void for_each(F&& f) const {  // id, place (m), index
    const auto p = state_.particles.view();
    for (std::size_t b = 0; b < state_.blocks.size(); ++b) {
      for (std::size_t i = state_.blocks.begin[b]; i < state_.blocks.begin[b + 1]; ++i) {
        const Vec3 cells = Vec3(p.x[0][i], p.x[1][i], p.x[2][i]) / kernels::kOneCell;
        f(p.id[i], world_in_block(state_.blocks.coord[b], cells, kDx), i);
      }
    }
  }
  template <class F>
  void for_each_of_layer(F&& f) const {  // place along the column as placed, Jp
    const auto p = state_.particles.view();
    for (std::size_t i = 0; i < state_.particles.size(); ++i) {
      if (p.object[i] == 1) f(placed_[p.id[i]].x(), p.Jp[i]);
    }
  }

  void take_cohesion() {
    for_each_of_layer([&](double x, float& jp) {
      if (x < cut_ && jp > 0) jp = -1;
    });
  }

  // A column of cells is broken when half of its layer has lost its cohesion.
  void note_broken() {
    std::vector<int> whole(broken_at_.size());
    for_each_of_layer(
        [&](double x, float jp) { whole[static_cast<std::size_t>(x / kDx)] += jp > 0 ? 1 : -1; });
    for (std::size_t c = 0; c < whole.size(); ++c) {
      if (whole[c] <= 0) broken_at_[c] = std::min(broken_at_[c], state_.time);
    }
  }

  Vec3 down_;
  Solver::State state_;
  std::vector<double> broken_at_;  // s, of each column of cells
  std::vector<Vec3> placed_;       // by id
  double cut_ = 0;                 // m
  bool runs_ = false;
};

double shear_speed() { return elastic_moduli(slab()).s_wave_speed; }

void add_to(Curve& curve, const SawTest& test, double degrees, double length) {
  const std::string series = std::to_string(std::lround(degrees));
  for (double x = 0.1; x < length - 0.1; x += 0.2) curve.add(series, {test.broken_at(x), x, shear_speed()});
}

}  // namespace

TEST_CASE("a slab on a layer that could collapse stands until it is cut, flat and on 38 degrees",
          "[physics]") {
  for (const double degrees : {0.0, 38.0}) {
    SawTest test(degrees, 6);
    test.load();
    test.wait(0.5);
    INFO(degrees << " degrees");
    CHECK(test.broken() == 0);
    CHECK(test.part(0, 6).velocity.norm() < 0.01);
  }
}

TEST_CASE("a saw cut makes an anticrack run, slower than shear waves where the broken layer holds the slab",
          "[physics][figure][slow]") {
  Curve curve("saw_flat", "series,time_s,front_m,shear_m_s");
  for (const double degrees : {0.0, 20.0}) {  // friction is 27 degrees
    SawTest test(degrees, 12);
    test.load();
    const double before = test.part(1, 4).way.y();
    test.saw(1.5);
    REQUIRE(test.all_broken());
    add_to(curve, test, degrees, 12);
    const double speed = test.crack_speed(5, 10) / shear_speed();
    const SawTest::Part behind = test.part(1, 4);
    INFO(degrees << " degrees: critical length " << test.critical_length() << " m, crack at " << speed
                 << " c_s, slab down " << before - behind.way.y() << " m and along " << behind.way.x());
    CHECK(test.critical_length() > 0.2);
    CHECK(test.critical_length() < 1.5);
    CHECK(speed < 0.6 * 1.15);
    CHECK(speed > 0.15);
    CHECK(test.crack_speed(7.5, 10) == Approx(test.crack_speed(5, 7.5)).epsilon(0.15));  // steady
    CHECK(before - behind.way.y() == Approx(kLayer * (1 - std::exp(-weak_layer().collapse))).epsilon(0.3));
    CHECK(behind.velocity.norm() < 0.05);
  }
}

TEST_CASE("on a slope steeper than the broken layer's friction the crack runs off to 1.6 times shear waves",
          "[physics][figure][slow]") {
  Curve curve("saw_steep", "series,time_s,front_m,shear_m_s");
  for (const double degrees : {32.0, 38.0}) {
    SawTest test(degrees, 20);
    test.load();
    test.saw(1.5);
    REQUIRE(test.all_broken());
    add_to(curve, test, degrees, 20);
    const double speed = test.crack_speed(10, 18) / shear_speed();
    INFO(degrees << " degrees: critical length " << test.critical_length() << " m, first metre at "
                 << test.crack_speed(0.8, 1.8) / shear_speed() << " c_s, then " << speed << " c_s");
    CHECK(test.critical_length() < 1.5);
    CHECK(test.crack_speed(0.8, 1.8) < 0.6 * 1.15 * shear_speed());
    CHECK(speed == Approx(1.6).epsilon(0.15));
    CHECK(test.crack_speed(14, 18) == Approx(test.crack_speed(10, 14)).epsilon(0.15));
    CHECK(test.part(1, 4).velocity.x() < -0.1);  // the slab goes
  }
}

}  // namespace firn::test::saw
