// SPDX-License-Identifier: MIT
// Lights from both ends of a path. Expectations come from rays that come upon the lights and from quadrature;
// sample() and emit() must find the same light with the densities that they claim.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "kernels/table.h"
#include "src/core/isa.h"
#include "src/geometry/mesh.h"
#include "src/render/lights/lights.h"
#include "src/render/sampling/directions.h"
#include "tests/catch.h"
#include "tests/light/chi2.h"

namespace firn::test::lights {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
const Vec3f kReceiver(0.3f, -0.2f, 0.4f);
const Vec3 kOrigin(100, 0, -50);  // of render space

// Lights, where they look from kReceiver, and objects that glow.
struct Case {
  std::string name;
  std::vector<Light> lights;
  std::vector<Object> objects;
  Cone cone = {};  // holds all of the light's density
};

// Lights about the receiver; world space.
struct Stage {
  explicit Stage(const Case& c)
      : objects(supported_kernels().back()->trace, c.objects, {glow()}), lights(c.lights, objects) {
    objects.place(kOrigin);
    lights.place(kOrigin, Vec3::Zero(), 4);
  }
  static Surface glow() {
    Surface surface;
    surface.kind = SurfaceKind::emission;
    surface.emission = Vec3f(1, 2, 0.5f);
    return surface;
  }
  ObjectSet objects;
  LightSet lights;
};

Mat3 some_rotation() {
  Mat3 r;
  r << 2, -1, 2, 2, 2, -1, -1, 2, 2;
  return r / 3;
}

Object glowing(const decltype(Shape::form)& form, const Vec3& at) {
  return {Shape{form, {some_rotation(), kOrigin + at}}, 0};
}

Mesh tetrahedron() {
  const std::vector<Vec3> corners{{0.4, 0.3, 0.3}, {-0.3, -0.3, 0.3}, {-0.3, 0.3, -0.3}, {0.3, -0.5, -0.3}};
  return {std::make_shared<TriangleMesh>(corners,
                                         std::vector<Triangle>{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}})};
}

std::shared_ptr<const ImageTexture> spotted_picture() {
  auto picture = std::make_shared<ImageTexture>();
  picture->width = 32, picture->height = 16;
  for (int k = 0; k < 32 * 16; ++k)
    picture->rgb.push_back(Vec3f(0.1f, 0.2f, 0.3f) * static_cast<float>(k % 7));
  picture->rgb[32 * 5 + 9] = Vec3f(300, 200, 100);
  return picture;
}

QuadLight quad(const Vec3& corner) { return {kOrigin + corner, {0.8, 0.1, 0}, {0, 0.2, -1}, {4, 3, 2}}; }

const Vec3f kSun = Vec3f(2, 3, -6) / 7;
SunLight sun(double degrees) { return {kSun.cast<double>(), degrees, {3, 2, 1}}; }
DaySkyLight day_sky() { return {kSun.cast<double>(), 3, 0.05, {0.1f, 0.1f, 0.1f}}; }
SkyLight gradient() { return {{0.1f, 0.3f, 0.9f}, {0.7f, 0.8f, 0.9f}, {0.2f, 0.1f, 0.05f}}; }

std::vector<Case> cases() {
  const Vec3 aside(1.3, 1.1, 0.2);
  return {
      {"quad", {quad({-0.5, -1.4, 0.7})}, {}},
      {"sphere", {SphereLight{kOrigin + aside, 0.5, {2, 1, 3}}}, {}},
      {"sun", {sun(0.2666)}, {}, {kSun, 1.5e-5f}},
      {"wide sun", {sun(20)}, {}, {kSun, 0.1f}},
      {"sky", {gradient()}, {}},
      {"constant", {ConstantLight{{1, 1, 1}}}, {}},
      {"day sky", {day_sky()}, {}},
      {"image", {ImageLight{spotted_picture(), 70, {1, 1, 2}}}, {}},
      {"glowing ball", {}, {glowing(Ball{0.5}, aside)}},
      {"glowing box", {}, {glowing(Box{{0.2, 0.3, 0.4}}, aside)}},
      {"glowing cylinder", {}, {glowing(Cylinder{0.3, 0.4}, aside)}},
      {"glowing capsule", {}, {glowing(Capsule{0.25, 0.4}, aside)}},
      {"glowing mesh", {}, {glowing(tetrahedron(), aside)}},
      {"glowing room", {}, {glowing(Box{{2, 1.5, 1.8}}, Vec3::Zero())}},
      {"everything",
       {quad({-0.5, -1.4, 0.7}), SphereLight{kOrigin + aside, 0.4, {2, 1, 3}}, sun(8), day_sky(), gradient(),
        ConstantLight{{0.2f, 0.2f, 0.2f}}},
       {glowing(Box{{0.3, 0.3, 0.3}}, Vec3(-1.2, 0.6, -1)), glowing(Ball{0.4}, Vec3(-1.5, 0.5, 1))}},
  };
}

// Every light on the way from p, as if those before it were not there: with its distance from p.
template <class Visit>
void each_light(const Stage& stage, const Vec3f& p, const Vec3f& d, const Visit& visit) {
  float gone = 0;
  for (;;) {
    const Vec3f o = p + gone * d;
    float t = kInfinity;
    const ObjectHit met = stage.objects.closest(o, d, kInfinity);
    LightHit hit, lamp;
    bool found = met.object >= 0;
    if (found) {
      t = met.t;
      REQUIRE(stage.lights.object_hit(met.object, d, met, hit));
    }
    if (stage.lights.hit(o, d, t, lamp)) hit = lamp, found = true;
    if (!found) break;
    visit(hit, gone + t);
    gone += t + 1e-4f;
  }
  visit(stage.lights.escape(p, d), kInfinity);
}

// Of points that are seen at an angle: at the rim of a glowing object the density has no bound.
constexpr float kGrazing = 0.2f;
double density_of(const Stage& stage, const Vec3f& p, const Vec3f& d) {
  double sum = 0;
  each_light(stage, p, d, [&](const LightHit& hit, float t) {
    if (hit.cosine > kGrazing) sum += stage.lights.pdf(p, d, t, hit);
  });
  return sum;
}

double radiance_of(const Stage& stage, const Vec3f& p, const Vec3f& d) {
  double sum = 0;
  each_light(stage, p, d,
             [&](const LightHit& hit, float) { sum += hit.pdf_emit > 0 ? hit.radiance.sum() : 0; });
  return sum;
}

bool draw(const Stage& stage, const Vec3f& p, std::uint64_t k, LightSample& out) {
  return stage.lights.sample(p, random_pair(3, k, 0).u, random_pair(3, k, 1), out);
}

struct Mean {
  double sum = 0, squares = 0;
  std::uint64_t count = 0;
  void add(double x) { sum += x, squares += x * x, ++count; }
  double value() const { return sum / static_cast<double>(count); }
  double error() const {
    const auto n = static_cast<double>(count);
    return std::sqrt(std::max(squares / n - value() * value(), 0.0) / n);
  }
};

// The light on the way from p that was sampled there.
bool find(const Stage& stage, const Vec3f& p, const LightSample& sample, LightHit& out) {
  bool found = false;
  each_light(stage, p, sample.direction, [&](const LightHit& hit, float t) {
    if (found || (std::isinf(t) != std::isinf(sample.distance))) return;
    if (std::isinf(t) || std::fabs(t - sample.distance) < 1e-3f) out = hit, found = true;
  });
  return found;
}

}  // namespace

TEST_CASE("lights are sampled with the density that pdf() tells", "[light]") {
  for (const Case& c : cases()) {
    const Stage stage(c);
    const auto direction = [&](std::uint64_t k) {
      LightSample sample;
      const bool seen = draw(stage, kReceiver, k, sample) && sample.cosine > kGrazing;
      return seen ? sample.direction : Vec3f(Vec3f::Zero());
    };
    INFO(c.name);
    CHECK(std::fabs(chi_squared_z(
              direction, 60000, [&](const Vec3f& d) { return density_of(stage, kReceiver, d); }, c.cone)) <
          4.5);
  }
}

TEST_CASE("a sampled point of a light is what a ray in its direction comes upon", "[light]") {
  for (const Case& c : cases()) {
    const Stage stage(c);
    INFO(c.name);
    int found = 0, drawn = 0;
    for (std::uint64_t k = 0; k < 2000; ++k) {
      LightSample sample;
      LightHit hit;
      if (!draw(stage, kReceiver, k, sample)) continue;
      // At grazing angles rounding decides whether the ray meets it, and how.
      if (sample.cosine < 0.05f) continue;
      ++drawn;
      if (!find(stage, kReceiver, sample, hit)) continue;
      ++found;
      REQUIRE((hit.radiance - sample.radiance).norm() <= 1e-4f * sample.radiance.norm());
      REQUIRE(hit.cosine == Approx(sample.cosine).epsilon(2e-3));
      REQUIRE(hit.pdf_emit == Approx(sample.pdf_emit).epsilon(2e-3));
      const float pdf = stage.lights.pdf(kReceiver, sample.direction, sample.distance, hit);
      REQUIRE(pdf * hit.cosine == Approx(sample.pdf * sample.cosine).epsilon(1e-4));
    }
    CHECK(drawn > 500);
    CHECK(found >= drawn - 2);
  }
}

TEST_CASE("many points look for light where each one would", "[light]") {
  constexpr std::size_t kPoints = 1003;  // fills no register
  std::vector<Case> all = cases();
  all.push_back({"suns and an image", {sun(8), sun(0.5), ImageLight{spotted_picture(), 70, {1, 1, 2}}}, {}});
  all.push_back({"suns in a black sky", {sun(8), sun(0.5), ConstantLight{{0, 0, 0}}}, {}});
  all.push_back({"no light", {ConstantLight{{0, 0, 0}}}, {}});
  for (const Case& c : all) {
    const Stage stage(c);
    std::vector<Vec3f> before;
    for (const auto* table : supported_kernels()) {
      std::vector<float> choice, u, v;
      RayStream rays;
      for (std::size_t i = 0; i < kPoints; ++i) {
        const Sample2 at = random_pair(3, i, 1);
        choice.push_back(random_pair(3, i, 0).u), u.push_back(at.u), v.push_back(at.v);
        rays.push(kReceiver + 0.01f * static_cast<float>(i % 5) * kSun, Vec3f::UnitZ(), 0);
      }
      stage.lights.aim(table->shade, choice.data(), u.data(), v.data(), rays);
      for (std::size_t i = 0; i < kPoints; ++i) {
        LightSample one;
        const bool seen = stage.lights.sample(rays.origin(i), choice[i], {u[i], v[i]}, one);
        INFO(c.name << ", " << table->isa << ", point " << i);
        REQUIRE(rays.t(i) == (seen ? one.distance : 0));
        if (seen) REQUIRE((rays.direction(i) - one.direction).norm() < 1e-6f);
        if (std::string(table->isa) == "base") continue;
        if (before.size() == kPoints) REQUIRE(rays.direction(i) == before[i]);  // of v3 on v4
      }
      before.clear();
      for (std::size_t i = 0; i < kPoints && std::string(table->isa) != "base"; ++i)
        before.push_back(rays.direction(i));
    }
  }
}

TEST_CASE("the light that samples find is that of all rays together", "[light]") {
  for (const Case& c : cases()) {
    const Stage stage(c);
    Mean mean;
    for (std::uint64_t k = 0; k < 100000; ++k) {
      LightSample sample;
      mean.add(draw(stage, kReceiver, k, sample) ? sample.radiance.sum() / sample.pdf : 0);
    }
    const double expected =
        integrate([&](const Vec3f& d) { return radiance_of(stage, kReceiver, d); }, c.cone, 700);
    INFO(c.name << ": " << mean.value() << " +- " << mean.error() << ", quadrature " << expected);
    // The quadrature misses parts of a cell at edges.
    CHECK(std::fabs(mean.value() - expected) < 4.5 * mean.error() + 2e-3 * expected);
  }
}

// Integral of the fluence over a ball: of light that starts at lights, by the lengths of the chords that it
// goes through the ball; by samples, at points of the ball. It is the same light.
TEST_CASE("lights send out what they are seen to bring", "[light]") {
  const float radius = 0.5f;
  const double volume = 4.0 / 3 * kPi * radius * radius * radius;
  for (const Case& c : cases()) {
    const Stage stage(c);
    Mean sent, seen;
    for (std::uint64_t k = 0; k < 400000; ++k) {
      Emission start;
      REQUIRE(stage.lights.emit(random_pair(7, k, 0).u, random_pair(7, k, 1), random_pair(7, k, 2), start));
      const Vec3f to = kReceiver - start.origin;
      const float along = to.dot(start.direction);
      const float depth2 = radius * radius - (to - along * start.direction).squaredNorm();
      const float chord = along > 0 && depth2 > 0 ? 2 * std::sqrt(depth2) : 0;
      sent.add(chord > 0 ? start.radiance.sum() * start.cosine / start.pdf_emit * chord : 0);
    }
    for (std::uint64_t k = 0; k < 100000; ++k) {
      const Sample2 at = random_pair(8, k, 0);
      const float r = radius * std::cbrt(random_pair(8, k, 1).u);
      const Vec3f p = kReceiver + r * cone_direction(Vec3f::UnitY(), 2, at);
      LightSample sample;
      seen.add(draw(stage, p, k, sample) ? sample.radiance.sum() / sample.pdf * volume : 0);
    }
    INFO(c.name << ": sent " << sent.value() << " +- " << sent.error() << ", seen " << seen.value() << " +- "
                << seen.error());
    CHECK(std::fabs(sent.value() - seen.value()) < 4.5 * std::hypot(sent.error(), seen.error()));
    CHECK(sent.error() < 0.05 * sent.value());
  }
}

TEST_CASE("emit() and the ray that comes back upon the light agree on its density", "[light]") {
  for (const Case& c : cases()) {
    const Stage stage(c);
    INFO(c.name);
    int compared = 0;
    for (std::uint64_t k = 0; k < 2000; ++k) {
      Emission start;
      REQUIRE(stage.lights.emit(random_pair(9, k, 0).u, random_pair(9, k, 1), random_pair(9, k, 2), start));
      REQUIRE(start.direction.norm() == Approx(1).epsilon(1e-5));
      if (start.cosine < 0.05f) continue;
      const float way = start.distant ? 4 : 0.3f;
      LightSample sample;
      sample.direction = -start.direction;
      sample.distance = start.distant ? kInfinity : way;
      LightHit hit;
      // A point on the disc's rim may fall outside by rounding.
      if (!find(stage, start.origin + way * start.direction, sample, hit) || !(hit.pdf_emit > 0)) continue;
      REQUIRE(hit.light == start.light);
      REQUIRE(hit.pdf_emit == Approx(start.pdf_emit).epsilon(1e-3));
      REQUIRE(hit.cosine == Approx(start.cosine).epsilon(1e-3));
      REQUIRE((hit.radiance - start.radiance).norm() <= 1e-4f * start.radiance.norm());
      // pdf_emit = pdf_start x density of the other: cosine / pi, or 1 / (pi R^2) of the disc.
      const float other = start.distant ? 1 / (kPi * 16) : start.cosine / kPi;
      REQUIRE(start.pdf_emit == Approx(start.pdf_start * other).epsilon(1e-4));
      ++compared;
    }
    CHECK(compared > 1500);
  }
}

TEST_CASE("a ray from infinity that misses the disc cannot have been emitted", "[light]") {
  const Stage stage({"", {ConstantLight{{1, 1, 1}}}, {}});
  CHECK(stage.lights.escape(Vec3f(3.9f, 7, 0), Vec3f::UnitY()).pdf_emit > 0);
  CHECK(stage.lights.escape(Vec3f(4.1f, -7, 0), Vec3f::UnitY()).pdf_emit == 0);
  CHECK(stage.lights.escape(Vec3f(4.1f, -7, 0), Vec3f::UnitY()).radiance == Vec3f::Ones());
}

TEST_CASE("a glowing plane is found by rays only", "[light]") {
  const Stage stage({"", {}, {{Shape{HalfSpace{}, {Mat3::Identity(), kOrigin + Vec3(0, -2, 0)}}, 0}}});
  LightSample sample;
  Emission start;
  CHECK_FALSE(stage.lights.sample(kReceiver, 0.5f, {0.5f, 0.5f}, sample));
  CHECK_FALSE(stage.lights.emit(0.5f, {0.5f, 0.5f}, {0.5f, 0.5f}, start));
  const Vec3f down(0, -1, 0);
  const ObjectHit met = stage.objects.closest(kReceiver, down, kInfinity);
  LightHit hit;
  REQUIRE(stage.lights.object_hit(met.object, down, met, hit));
  CHECK(hit.radiance == Vec3f(1, 2, 0.5f));
  CHECK(hit.pdf_emit == 0);
  CHECK(stage.lights.pdf(kReceiver, down, met.t, hit) == 0);
}

TEST_CASE("a quad shines to one side", "[light]") {
  const Stage stage({"", {quad({-0.5, -1.4, 0.7})}, {}});
  LightSample sample;
  CHECK_FALSE(draw(stage, Vec3f(0, -3, 0), 0, sample));
  LightHit hit;
  float t = kInfinity;
  CHECK_FALSE(stage.lights.hit(Vec3f(-0.1f, -3, 0.2f), Vec3f::UnitY(), t, hit));
  CHECK(std::isinf(t));
}

// Preetham, Shirley, Smits 1999: with turbidity 3 and the sun 30 degrees from the zenith, Y_z = (4.0453 T
// - 4.9710) tan((4/9 - T/120) (pi - 2 theta)) - 0.2155 T + 2.4192 = 9.28 kcd/m^2.
TEST_CASE("the day sky has the zenith luminance of its source and is blue away from the sun", "[light]") {
  const Vec3 sun(0.5, std::sqrt(0.75), 0);
  const Case c{"", {DaySkyLight{sun, 3, 1, Vec3f::Zero()}}, {}};
  const Stage stage(c);
  const Vec3f zenith = stage.lights.escape(Vec3f::Zero(), Vec3f::UnitY()).radiance;
  const double luminance = 0.2126 * zenith.x() + 0.7152 * zenith.y() + 0.0722 * zenith.z();
  const double angle = std::acos(-1.0) / 6;
  const double chi = (4.0 / 9 - 3.0 / 120) * (std::acos(-1.0) - 2 * angle);
  CHECK(luminance == Approx((4.0453 * 3 - 4.9710) * std::tan(chi) - 0.2155 * 3 + 2.4192).epsilon(2e-3));
  CHECK(zenith.z() > 1.5f * zenith.x());
  const Vec3f near = stage.lights.escape(Vec3f::Zero(), Vec3f(0.6f, 0.8f, 0)).radiance;
  const Vec3f opposite = stage.lights.escape(Vec3f::Zero(), Vec3f(-0.6f, 0.8f, 0)).radiance;
  CHECK(near.y() > 2 * opposite.y());
}

}  // namespace firn::test::lights
