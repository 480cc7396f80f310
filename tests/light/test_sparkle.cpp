// SPDX-License-Identifier: MIT
// Glints: the statistics of facets, the mean of what they reflect, and that they are part of the snow.
#include <Eigen/Geometry>
#include <cmath>
#include <memory>

#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/core/rotation.h"
#include "src/render/directions.h"
#include "src/render/sparkle.h"
#include "tests/catch.h"
#include "tests/light/pictures.h"

using namespace firn;

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

Vec3f random_direction(std::uint64_t key) {
  const float z = 2 * uniform_float(mix64(key)) - 1;
  const Disc flat = on_circle(std::sqrt(1 - z * z), uniform_float(mix64(~key)));
  return {flat.x, flat.y, z};
}

// In the cone of `radius` about h, either side up.
bool glints(const Vec3f& facet, const Vec3f& h, double radius) {
  return std::fabs(facet.dot(h)) > std::cos(radius);
}

constexpr double kSpacing = 0.01;

// A block of snow of 40 x 12 x 40 jittered particles whose top is at y = 0.
Snapshot block() {
  Snapshot snapshot;
  snapshot.dx = 2 * kSpacing;
  const std::uint32_t count = 40 * 12 * 40;
  snapshot.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double cell[3] = {i % 40 - 19.5, -0.5 - i / 1600, i / 40 % 40 - 19.5};
    for (int a = 0; a < 3; ++a) {
      const double jitter = 0.5 * (uniform_double(hash_keys(8, i, a)) - 0.5);
      snapshot.x[a][i] = static_cast<float>(kSpacing * (cell[a] + jitter));
    }
    snapshot.density[i] = 300;
    snapshot.volume0[i] = static_cast<float>(kSpacing * kSpacing * kSpacing);
    snapshot.id[i] = i;
  }
  return snapshot;
}

SnowLook look_of(const SparkleSettings& settings) {
  SnowLook look;
  look.sparkle = settings;
  return look;
}

struct Glinting {  // snow that is ready to glint
  Snapshot snapshot;
  std::vector<SnowLook> looks;
  RenderGrid grid{supported_kernels().back()->trace};
  std::unique_ptr<Sparkle> sparkle;

  Glinting(Snapshot snow, const SparkleSettings& settings)
      : snapshot(std::move(snow)), looks{look_of(settings)} {
    grid.build(snapshot, looks, true);
    sparkle = std::make_unique<Sparkle>(grid, snapshot, looks);
  }
  Vec3f render_space(const Vec3& world) const { return (world - grid.origin()).cast<float>(); }
  float at(const Vec3& world, const Vec3f& normal, const Vec3f& wo, const Vec3f& wi, float cone = 0,
           float footprint = 0) const {
    return sparkle->brdf(render_space(world), normal, wo, wi, cone, footprint);
  }
};

Vec3 on_top(std::uint64_t key) {  // away from the block's sides
  return {0.28 * (uniform_double(hash_keys(21, key)) - 0.5), 0,
          0.28 * (uniform_double(hash_keys(22, key)) - 0.5)};
}

// Microfacets of density D = N a / 2 pi, written independently of the source.
double smooth_brdf(const SparkleSettings& s, const Vec3& n, const Vec3& o, const Vec3& i) {
  const Vec3 h = (o + i).normalized();
  const double c = o.dot(h), sine_in = std::sqrt(1 - c * c),
               cos_t = std::sqrt(1 - sine_in * sine_in / (1.31 * 1.31));
  const double rs = (c - 1.31 * cos_t) / (c + 1.31 * cos_t), rp = (1.31 * c - cos_t) / (1.31 * c + cos_t);
  const double groove = std::min({1.0, 2 * n.dot(h) * n.dot(o) / c, 2 * n.dot(h) * n.dot(i) / c});
  const double density = s.density * 3.14159265358979 * s.size * s.size / (2 * 3.14159265358979);
  return s.strength * (rs * rs + rp * rp) / 2 * groove * density / (4 * n.dot(o) * n.dot(i));
}

}  // namespace

TEST_CASE("glints in a region of N facets are binomial", "[light]") {
  const int regions = 10000, facets = 400, bins = 12;
  const double radius = 7 * kDegree, p = 1 - std::cos(radius);  // N p = 3
  std::vector<double> seen(bins, 0), expected(bins, 0);
  for (int region = 0; region < regions; ++region) {
    const Vec3f h = random_direction(hash_keys(1, region));
    int count = 0;
    for (int k = 0; k < facets; ++k) {  // eight a particle
      count += glints(
          facet_normal(static_cast<std::uint32_t>(region * 50 + k / 8), static_cast<std::uint32_t>(k % 8)), h,
          radius);
    }
    seen[std::min(count, bins - 1)] += 1;
  }
  double chance = std::pow(1 - p, facets), rest = 1;
  for (int k = 0; k < bins - 1; ++k) {
    expected[k] = regions * chance;
    rest -= chance;
    chance *= (facets - k) * p / ((k + 1) * (1 - p));
  }
  expected[bins - 1] = regions * rest;
  double chi2 = 0;
  for (int k = 0; k < bins; ++k) chi2 += (seen[k] - expected[k]) * (seen[k] - expected[k]) / expected[k];
  INFO("chi^2 " << chi2);
  CHECK(chi2 < 24.7);  // 11 degrees of freedom, p > 0.01
  CHECK(chi2 > 3.05);  // nor too good: p < 0.99
}

TEST_CASE("where a particle's facets lie is even and owes nothing to where they look", "[light]") {
  const int count = 200000;
  Vec3 mean = Vec3::Zero(), square = Vec3::Zero(), normal = Vec3::Zero(), cross = Vec3::Zero();
  for (int i = 0; i < count; ++i) {
    const Vec3 at =
        facet_place(static_cast<std::uint32_t>(i / 4), static_cast<std::uint32_t>(i % 4)).cast<double>();
    const Vec3 way =
        facet_normal(static_cast<std::uint32_t>(i / 4), static_cast<std::uint32_t>(i % 4)).cast<double>();
    REQUIRE(at.cwiseAbs().maxCoeff() < 0.5);
    REQUIRE(way.norm() == Approx(1).epsilon(1e-6));
    mean += at / count;
    square += at.cwiseAbs2() / count;
    normal += way.cwiseAbs2() / count;
    cross += at.cwiseProduct(way) / count;
  }
  const double sigma = 1 / std::sqrt(12.0 * count);
  CHECK(mean.cwiseAbs().maxCoeff() < 4 * sigma);
  CHECK((square - Vec3::Constant(1 / 12.)).cwiseAbs().maxCoeff() < 1e-3);
  CHECK((normal - Vec3::Constant(1 / 3.)).cwiseAbs().maxCoeff() < 3e-3);
  CHECK(cross.cwiseAbs().maxCoeff() < 4 * sigma / std::sqrt(3.0));
}

TEST_CASE("of the glints a turn of the half vector keeps the overlap of two discs", "[light]") {
  const double radius = 2 * kDegree;
  const Vec3f h(0, 0, 1);
  std::vector<Vec3f> before;
  for (std::uint32_t i = 0; i < 20000000; ++i) {
    const Vec3f facet = facet_normal(i, 0);
    if (glints(facet, h, radius)) before.push_back(facet);
  }
  REQUIRE(before.size() > 10000);
  for (const double x : {0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.1}) {  // turn / (2 radius)
    const double turn = 2 * radius * x;
    const Vec3f turned(static_cast<float>(std::sin(turn)), 0, static_cast<float>(std::cos(turn)));
    double kept = 0;
    for (const Vec3f& facet : before) kept += glints(facet, turned, radius);
    const double share = x < 1 ? 2 / 3.14159265358979 * (std::acos(x) - x * std::sqrt(1 - x * x)) : 0;
    CHECK(kept / static_cast<double>(before.size()) == Approx(share).margin(0.02));
  }
}

TEST_CASE("glints reflect in the mean what smooth microfacets do", "[light]") {
  const Vec3f n(0, 1, 0), wo = Vec3f(0.3f, 0.8f, 0.2f).normalized(),
                          wi = Vec3f(-0.6f, 0.5f, 0.4f).normalized();
  const std::vector<SparkleSettings> all = {{1e5, 1e-3, 6, 1},
                                            {4e4, 3e-3, 10, 2},
                                            {2e6, 0.2e-3, 6, 1} /* merged into larger ones */,
                                            {5e3, 4e-3, 15, 1} /* fewer than one a particle */};
  for (const SparkleSettings& settings : all) {
    const Glinting snow(block(), settings);
    REQUIRE(snow.sparkle->any());
    for (const float cone : {0.f, 0.1f}) {
      double sum = 0;
      const int points = 60000;
      for (int k = 0; k < points; ++k) sum += snow.at(on_top(k), n, wo, wi, cone, 3e-3f);
      const double smooth = smooth_brdf(settings, n.cast<double>(), wo.cast<double>(), wi.cast<double>());
      // Facets that glint in the 0.28 m square: N of them at least, each by how deep it lies.
      const double spread = std::pow(2 * std::sin(settings.roughness * kDegree / 2), 2) + cone * cone / 4;
      const double facets = std::min(settings.density, 32 / (kSpacing * kSpacing / 2)) * 0.28 * 0.28;
      const double error = 3 / std::sqrt(facets * spread / 2);
      INFO("density " << settings.density << ", cone " << cone << ", error allowed " << error);
      CHECK(sum / points / smooth == Approx(1).margin(error));
    }
  }
}

TEST_CASE("a footprint spreads glints and keeps their mean", "[light]") {
  const Vec3f n(0, 1, 0), wo = Vec3f(0.1f, 0.9f, 0).normalized(), wi = Vec3f(-0.5f, 0.5f, 0).normalized();
  const Glinting snow(block(), {1e5, 3e-3, 8, 1});
  double sharp = 0, wide = 0, sharp2 = 0, wide2 = 0;
  for (std::uint64_t k = 0; k < 200000; ++k) {
    const double a = snow.at(on_top(k), n, wo, wi), b = snow.at(on_top(k), n, wo, wi, 0, 5e-3f);
    sharp += a, sharp2 += a * a;
    wide += b, wide2 += b * b;
  }
  CHECK(sharp == Approx(wide).epsilon(0.06));          // some 5000 of the points meet a glint: three sigma
  CHECK(wide2 / sharp2 == Approx(0.36).margin(0.08));  // (3 / 5)^2 where glints are alone
}

TEST_CASE("light and eye may change places, and from below nothing glints", "[light]") {
  const Vec3f n(0, 1, 0);
  const Glinting snow(block(), {1e5, 2e-3, 15, 1});
  int bright = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3f a = cosine_direction(n, {uniform_float(hash_keys(1, k)), uniform_float(hash_keys(2, k))});
    const Vec3f b = cosine_direction(n, {uniform_float(hash_keys(3, k)), uniform_float(hash_keys(4, k))});
    const float there = snow.at(on_top(k), n, a, b);
    bright += there > 0;
    REQUIRE(there == Approx(snow.at(on_top(k), n, b, a)));
    REQUIRE(snow.at(on_top(k), n, a, -b) == 0);
    REQUIRE(snow.at(on_top(k), n, -a, b) == 0);
  }
  CHECK(bright > 100);
  CHECK_FALSE(Glinting(block(), {}).sparkle->any());
  CHECK(Glinting(block(), {}).at(on_top(1), n, n, n) == 0);
}

// Snow that moves and turns as a whole carries its glints: seen from a camera and lit by a light that move
// with it, every point is what it was. The turn is packed to 1e-4 rad of a cone of 0.05, and the grid lies
// otherwise.
TEST_CASE("snow that is carried away and turned glints as before", "[light]") {
  const SparkleSettings settings{1e5, 2e-3, 3, 1};
  const Glinting before(block(), settings);
  const Mat3 turn = Eigen::AngleAxisd(2.2, Vec3(1, 2, -2).normalized()).toRotationMatrix();
  const Vec3 shift(3, -7, 12);
  Snapshot moved = block();
  moved.origin = shift;
  const PackedRotation packed = pack_rotation(turn);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const Vec3 x = turn * Vec3(moved.x[0][i], moved.x[1][i], moved.x[2][i]);
    for (int a = 0; a < 3; ++a) {
      moved.x[a][i] = static_cast<float>(x[a]);
      moved.turn[a][i] = packed[a];
    }
  }
  const Glinting after(std::move(moved), settings);
  const Vec3f n(0, 1, 0);
  const Eigen::Matrix3f t = turn.cast<float>();
  double sum = 0, difference = 0, unturned = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3f wo = cosine_direction(n, {0.3f, uniform_float(hash_keys(5, k))});
    const Vec3f wi = cosine_direction(n, {0.4f, uniform_float(hash_keys(6, k))});
    const double was = before.at(on_top(k), n, wo, wi);
    const double is = after.at(turn * on_top(k) + shift, t * n, t * wo, t * wi);
    sum += was;
    difference += std::fabs(was - is);
    unturned += std::fabs(was - after.at(turn * on_top(k) + shift, t * n, wo, t * wi));
  }
  INFO("changed by " << difference / sum);
  CHECK(sum > 0);
  CHECK(difference < 0.02 * sum);
  CHECK(unturned > 0.5 * sum);  // glints do tell a turn
}

TEST_CASE("a glint does not jump when the sun or the snow's surface moves a little", "[light]") {
  const Glinting snow(block(), {1e5, 4e-3, 5, 1});
  const Vec3f wo = Vec3f(0.2f, 0.9f, 0).normalized();
  const auto seen = [&](std::uint64_t k, double angle, double height) {
    const Vec3f wi(static_cast<float>(-std::sin(angle)), static_cast<float>(std::cos(angle)), 0);
    return snow.at(on_top(k) + Vec3(0, height, 0), Vec3f(0, 1, 0), wo, wi);
  };
  double most = 0, step = 0;
  for (std::uint64_t k = 0; k < 300; ++k) {
    for (double angle = 0.4; angle < 0.8; angle += 0.01) {
      const double now = seen(k, angle, 0);
      most = std::max(most, now);
      // 1/350 of the cone, 1/100 of a spacing.
      step =
          std::max({step, std::fabs(seen(k, angle + 5e-4, 0) - now), std::fabs(seen(k, angle, 1e-4) - now)});
    }
  }
  REQUIRE(most > 0);
  CHECK(step < 0.03 * most);
}
