// SPDX-License-Identifier: MIT
// Glints: how many there are, how they come and go, what they send back in the mean, and that they belong to
// the snow.
#include "src/render/snow/sparkle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "src/core/isa.h"
#include "src/core/rotation.h"
#include "src/render/sampling/directions.h"
#include "tests/catch.h"
#include "tests/curve.h"
#include "tests/light/pictures.h"
#include "tests/points.h"

namespace firn::test::sparkle {

namespace {

Vec3f any_direction(std::uint64_t key) {
  const float z = 2 * uniform_float(hash_keys(key, 1)) - 1;
  const Disc flat = on_circle(std::sqrt(1 - z * z), uniform_float(hash_keys(key, 2)));
  return {flat.x, flat.y, z};
}

Vec3f any_place(std::uint64_t key, float size) {
  return size * (Vec3f(uniform_float(hash_keys(key, 3)), uniform_float(hash_keys(key, 4)),
                       uniform_float(hash_keys(key, 5))) -
                 Vec3f::Constant(0.5f));
}

SparkleSettings settings(double density, double size, double roughness) {
  SparkleSettings s;
  s.density = density;
  s.size = size;
  s.roughness = roughness;
  return s;
}

// Facets of one particle within a cube of edge 2 `box` and within `chord` of a direction.
int count(const FacetField& field, std::uint32_t id, const Vec3f& at, float box, const Vec3f& half,
          float chord) {
  int found = 0;
  field.near(id, at, Vec3f::Constant(box), half, chord, [&](const Vec3f& place, const Vec3f& normal) {
    found += (place - at).cwiseAbs().maxCoeff() < box && (normal - half).norm() < chord;
  });
  return found;
}

// Snow, its grid and its glints.
struct Glinting {
  Glinting(Snapshot given, const SparkleSettings& s)
      : snapshot(std::move(given)), looks(1), grid(supported_kernels().back()->trace) {
    looks[0].sparkle = s;
    grid.build(snapshot, looks);
    sparkle.emplace(grid, snapshot, looks);
    sorted_of.resize(snapshot.size());
    for (std::uint32_t i = 0; i < snapshot.size(); ++i) sorted_of[grid.snapshot_index(i)] = i;
  }
  Vec3f place(const Vec3& world) const { return (world - grid.origin()).cast<float>(); }

  Snapshot snapshot;
  std::vector<SnowLook> looks;
  RenderGrid grid;
  std::optional<Sparkle> sparkle;
  std::vector<std::uint32_t> sorted_of;
};

// Its particles stand in for so many independent pieces of surface.
constexpr double kSpacing = 0.01;
Snapshot some_snow() { return test::snowball(Vec3(0.3, 0.2, 0.1), 0.1, kSpacing); }

// A turn and shift of the whole snow.
Snapshot moved(const Snapshot& from, const Mat3& turn, const Vec3& shift) {
  Snapshot to = from;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3 x = turn * vec(from.world_position(i)) + shift - vec(to.origin);
    const auto before = unpack_rotation({from.rotation[0][i], from.rotation[1][i], from.rotation[2][i]});
    const PackedRotation after = pack_rotation(turn * before.cast<double>());
    for (int a = 0; a < 3; ++a) {
      to.position[a][i] = static_cast<float>(x[a]);
      to.rotation[a][i] = after[a];
    }
  }
  return to;
}

}  // namespace

// Of the N facets in a cube that face outward, each has its normal in a cone with chance p = its solid angle
// / 2 pi.
TEST_CASE("the number of facets in a cone, over ten thousand particles, is binomial", "[light][figure]") {
  Curve curve("light_glint_counts", "series,count,expected,measured");
  for (const double roughness : {0.5, 3.0, 20.0}) {
    const SparkleSettings s = settings(2e6, 0.2e-3, roughness);
    const FacetField field(s);
    const float box = 2e-3f, chord = 0.1f;
    const double n = s.density / (2 * s.size) * std::pow(2 * box, 3), p = chord * chord / 2;
    constexpr int kRegions = 10000, kBins = 12;
    std::vector<double> seen(kBins, 0.), expected(kBins, 0.);
    double total = 0;
    for (std::uint32_t id = 0; id < kRegions; ++id) {
      const int found = count(field, id, any_place(id, 1), box, any_direction(id), chord);
      ++seen[std::min(found, kBins - 1)];
      total += found;
    }
    double chance = std::pow(1 - p, n), rest = 1;
    for (int k = 0; k < kBins - 1; ++k) {
      expected[k] = kRegions * chance;
      rest -= chance;
      chance *= (n - k) / (k + 1) * p / (1 - p);
    }
    expected[kBins - 1] = kRegions * rest;
    double chi2 = 0;
    int freedom = -1;
    for (int k = 0; k < kBins; ++k) {
      curve.add("cone of a facet: " + std::string(roughness < 1    ? "0.5"
                                                  : roughness < 10 ? "3"
                                                                   : "20"),
                {static_cast<double>(k), expected[k], seen[k]});
      if (expected[k] < 5) continue;
      chi2 += (seen[k] - expected[k]) * (seen[k] - expected[k]) / expected[k];
      ++freedom;
    }
    // chi2 is near normal after Wilson and Hilferty 1931; 2.33: p = 0.01.
    const double z = (std::cbrt(chi2 / freedom) - (1 - 2. / (9 * freedom))) / std::sqrt(2. / (9 * freedom));
    INFO("roughness " << roughness << ", mean " << total / kRegions << " for " << n * p << ", chi2 " << chi2
                      << " of " << freedom);
    CHECK(z < 2.33);
    CHECK(freedom >= 4);
  }
}

TEST_CASE("facets look everywhere alike, and any question finds the same ones", "[light]") {
  const FacetField field(settings(1e6, 0.3e-3, 2));
  // All directions at once against the sum over eight octants of the sphere and of the cube.
  const Vec3f at(0.01f, -0.02f, 0.03f);
  int octants[8] = {}, all = 0;
  double z4 = 0;
  for (std::uint32_t id = 0; id < 40; ++id) {
    field.near(id, at, Vec3f::Constant(2e-3f), Vec3f::UnitZ(), 2.1f, [&](const Vec3f& place, const Vec3f& n) {
      if ((place - at).cwiseAbs().maxCoeff() >= 2e-3f) return;
      ++octants[(n.x() > 0) + 2 * (n.y() > 0) + 4 * (n.z() > 0)];
      z4 += std::pow(n.z(), 4);
      CHECK(n.norm() == Approx(1).epsilon(1e-5));
      ++all;
    });
    const int whole = count(field, id, at, 2e-3f, Vec3f::UnitX(), 2.1f);
    int parts = 0;
    for (int k = 0; k < 8; ++k) {
      const Vec3f corner(k & 1 ? 1e-3f : -1e-3f, k & 2 ? 1e-3f : -1e-3f, k & 4 ? 1e-3f : -1e-3f);
      parts += count(field, id, at + corner, 1e-3f, Vec3f::UnitY(), 2.1f);
    }
    CHECK(parts == whole);
  }
  const double mean = 2 * 1e6 / 0.6e-3 * std::pow(4e-3, 3) * 40;  // 2: inward ones too
  CHECK(all == Approx(mean).margin(4 * std::sqrt(mean)));
  for (const int octant : octants) CHECK(octant == Approx(mean / 8).margin(4.5 * std::sqrt(mean / 8)));
  CHECK(z4 / all == Approx(0.2).margin(4 * 0.27 / std::sqrt(mean)));
}

TEST_CASE("glints stay as the half vector turns, as far as two cones overlap", "[light][figure]") {
  Curve curve("light_glint_turn", "series,part,expected,measured,error");
  const double roughness = 3;
  const FacetField field(settings(2e6, 0.3e-3, roughness));
  const auto chord = static_cast<float>(2 * std::sin(0.5 * roughness * kPi / 180));
  for (const double part :
       {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}) {  // x = turned by / two cones
    const double turned = 2 * part * chord;
    double kept = 0, all = 0;
    for (std::uint32_t id = 0; id < 20000; ++id) {
      const Vec3f half = any_direction(id), at = any_place(id, 1);
      const Vec3f other =
          around(half, static_cast<float>(std::sin(turned)), 0, static_cast<float>(std::cos(turned)));
      field.near(id, at, Vec3f::Constant(3e-3f), half, chord, [&](const Vec3f& place, const Vec3f& normal) {
        if ((place - at).cwiseAbs().maxCoeff() > 3e-3f || (normal - half).norm() >= chord) return;
        ++all;
        kept += (normal - other).norm() < chord;
      });
    }
    const double expected = 2 / kPi * (std::acos(part) - part * std::sqrt(1 - part * part));
    INFO("turned by " << part << " of two cones, " << all << " glints");
    CHECK(all > 10000);
    CHECK(kept / all == Approx(expected).margin(0.02));
    curve.add("glints", {part, expected, kept / all, std::sqrt(expected * (1 - expected) / all)});
  }
}

TEST_CASE("in the mean, glints are the smooth microfacet BRDF, for any light and any footprint",
          "[light][figure]") {
  Curve curve("light_glint_mean", "series,light_degrees,expected,measured,error,glints");
  const Snapshot snow = some_snow();
  const Vec3f n = Vec3f(0.2f, 0.9f, -0.3f).normalized();
  const Vec3f wo = around(n, 0.6f, 0, 0.8f), wi = around(n, -0.3f, 0.5f, std::sqrt(1 - 0.34f));
  for (const auto& s : {settings(3e6, 0.3e-3, 2), settings(2e7, 0.1e-3, 5), settings(3e4, 2e-3, 4)}) {
    const Glinting scene(snow, s);
    const float smooth = scene.sparkle->mean_brdf(0, n, wo, wi);
    // F N a / (2 pi 2 (cos_i + cos_o)); a = 2/3 pi r^2, F of ice at 36 degrees.
    CHECK(smooth ==
          Approx(0.0186 * s.density * 2 / 3 * s.size * s.size / (4 * (0.8 + std::sqrt(0.66)))).epsilon(0.03));
    for (const float light : {0.f, 0.2666f * kPi / 180, 0.08f}) {
      for (const float footprint : {0.f, 3e-3f}) {
        double sum = 0, squares = 0, glints = 0;
        constexpr int kPoints = 150000;
        for (int k = 0; k < kPoints; ++k) {
          const std::uint64_t key = hash_keys(5, k);
          const auto sorted = static_cast<std::uint32_t>(key % snow.size());
          const Vec3f p = scene.grid.center(sorted) + any_place(key, 0.01f);
          // A common turn of all about the normal, so that every facet of a particle has its chance.
          const float turn = uniform_float(hash_keys(key, 8));
          const Disc c = on_circle(1, turn);
          const auto turned = [&](const Vec3f& w) {
            const float x = w.dot(around(n, 1, 0, 0)), y = w.dot(around(n, 0, 1, 0));
            return around(n, c.x * x - c.y * y, c.y * x + c.x * y, w.dot(n));
          };
          const double f = scene.sparkle->brdf(sorted, p, n, turned(wo), turned(wi), light, footprint);
          sum += f;
          squares += f * f;
          glints += f > 0;
        }
        const double mean = sum / kPoints, error = std::sqrt((squares / kPoints - mean * mean) / kPoints);
        INFO("density " << s.density << ", light " << light << ", footprint " << footprint << ": " << mean
                        << " +- " << error << " for " << smooth << ", " << glints << " glints");
        CHECK(std::fabs(mean / smooth - 1) < 3 / std::sqrt(glints));
        curve.add(std::to_string(static_cast<int>(s.density / 1e4)) + "/cm\u00b2, " +
                      (footprint > 0 ? "3 mm" : "a point"),
                  {light * 180 / kPi, 1, mean / smooth, error / smooth, glints});
        CHECK(std::fabs(mean - smooth) < 3.5 * error + 1e-9);
        CHECK(error < 0.2 * smooth);
      }
    }
  }
}

TEST_CASE("light and eye may change places, from below nothing glints, and a wide light sees the mean",
          "[light]") {
  const Glinting scene(some_snow(), settings(3e6, 0.5e-3, 8));
  const Vec3f n = Vec3f::UnitY();
  int bright = 0;
  for (int k = 0; k < 5000; ++k) {
    const std::uint64_t key = hash_keys(17, k);
    const Vec3f a = cosine_direction(n, {uniform_float(key), uniform_float(mix64(key))});
    const Vec3f b = cosine_direction(n, {uniform_float(hash_keys(key, 1)), uniform_float(hash_keys(key, 2))});
    const Vec3f p = scene.grid.center(7) + any_place(key, 0.01f);
    const float there = scene.sparkle->brdf(7, p, n, a, b);
    bright += there > 0;
    REQUIRE(there == Approx(scene.sparkle->brdf(7, p, n, b, a)));
    REQUIRE(scene.sparkle->brdf(7, p, n, a, -b) == 0);
    REQUIRE(scene.sparkle->brdf(7, p, n, -a, b) == 0);
    REQUIRE(scene.sparkle->brdf(7, p, n, a, b, 1.5f) == scene.sparkle->mean_brdf(7, n, a, b));
  }
  CHECK(bright > 20);
  const Glinting none(some_snow(), SparkleSettings{});
  CHECK_FALSE(none.sparkle->any());
  CHECK(none.sparkle->brdf(7, none.grid.center(7), n, n, n) == 0);
}

// The disc of the sun comes into a facet's cone and leaves it little by little.
TEST_CASE("a glint does not jump while the sun goes its way", "[light]") {
  const Glinting scene(some_snow(), settings(3e6, 1e-3, 3));
  const Vec3f n = Vec3f::UnitY(), wo = Vec3f(0.2f, 0.9f, 0).normalized();
  const float sun = 0.2666f * kPi / 180;
  double most = 0, step = 0;
  int glints = 0;
  for (std::uint32_t point = 0; point < 300; ++point) {
    double last = 0;
    for (int k = 0; k <= 1000; ++k) {
      const double angle = 0.5 + 1e-4 * k;
      const Vec3f wi(static_cast<float>(-std::sin(angle)), static_cast<float>(std::cos(angle)), 0);
      const double now = scene.sparkle->brdf(point, scene.grid.center(point), n, wo, wi, sun, 3e-3f);
      if (k > 0) step = std::max(step, std::fabs(now - last));
      glints += k > 0 && now > 0 && last == 0;
      most = std::max(most, now);
      last = now;
    }
  }
  CHECK(glints > 5);
  CHECK(step < 0.02 * most);  // a half vector turns by 5e-5 of the sun's 4.7e-3
}

TEST_CASE("snow that is turned and moved takes its glints along", "[light]") {
  const Snapshot snow = some_snow();
  const SparkleSettings s = settings(3e6, 0.5e-3, 3);
  const Glinting before(snow, s);
  const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  const Vec3 shift(0.5, -0.2, 0.7);
  const Glinting after(moved(snow, turn, shift), s), stays(moved(snow, Mat3::Identity(), shift), s);
  const Eigen::Matrix3f turnf = turn.cast<float>();
  int glints = 0, same = 0, other = 0;
  double change = 0, all = 0;
  for (int k = 0; k < 200000; ++k) {
    const std::uint64_t key = hash_keys(11, k);
    const auto particle = static_cast<std::uint32_t>(key % snow.size());
    const Vec3 world = vec(snow.world_position(particle)) + any_place(key, 0.01f).cast<double>();
    const Vec3f n = any_direction(key), h = cosine_direction(n, {0.3f * uniform_float(mix64(key)), 0.4f});
    const Vec3f wo = cone_direction(h, 0.2f, {uniform_float(hash_keys(key, 9)), 0.1f});
    const Vec3f wi = 2 * wo.dot(h) * h - wo;
    const float a = before.sparkle->brdf(before.sorted_of[particle], before.place(world), n, wo, wi, 0.02f);
    const float b = after.sparkle->brdf(after.sorted_of[particle], after.place(turn * world + shift),
                                        turnf * n, turnf * wo, turnf * wi, 0.02f);
    const float c = stays.sparkle->brdf(stays.sorted_of[particle], stays.place(world + shift), n, turnf * wo,
                                        turnf * wi, 0.02f);
    glints += a > 0;
    same += a > 0 && std::fabs(a - b) < 0.02f * a;
    other += a > 0 && c > 0;
    change += std::fabs(a - b);
    all += a;
  }
  INFO(glints << " glints, " << same << " the same, mean change " << change / all);
  CHECK(glints > 300);
  // The turn is rounded to 1e-4 rad: facets at the edge of their disc or cone differ.
  CHECK(same > 0.9 * glints);
  CHECK(change < 0.02 * all);
  CHECK(other < 0.1 * glints);  // they would not, if facets did not turn with the snow
}

TEST_CASE("glints are a function of the place in the snow, whatever else there is", "[light]") {
  Snapshot snow = some_snow();
  const SparkleSettings s = settings(3e6, 0.5e-3, 3);
  const Glinting whole(snow, s);
  // The same snow in another order, with half of it gone.
  Snapshot less = snow;
  std::size_t kept = 0;
  for (std::size_t i = snow.size(); i-- > 0;) {
    if (snow.id[i] % 2) continue;
    for (int a = 0; a < 3; ++a) less.position[a][kept] = snow.position[a][i];
    less.id[kept++] = snow.id[i];
  }
  less = test::resized(less, kept);
  const Glinting part(less, s);
  const Vec3f n = Vec3f::UnitY();
  int glints = 0;
  for (std::uint32_t k = 0; k < less.size(); ++k) {
    const auto id = less.id[k];
    for (int j = 0; j < 200; ++j) {
      const std::uint64_t key = hash_keys(13, k, j);
      const Vec3 world = vec(less.world_position(k)) + any_place(key, 0.01f).cast<double>();
      const Vec3f wo = cosine_direction(n, {0.5f * uniform_float(key), uniform_float(mix64(key))});
      const float a = whole.sparkle->brdf(whole.sorted_of[id], whole.place(world), n, wo, n, 0, 1e-3f);
      const float b = part.sparkle->brdf(part.sorted_of[k], part.place(world), n, wo, n, 0, 1e-3f);
      glints += a > 0;
      CHECK(std::fabs(a - b) <= 1e-3f * a);
    }
  }
  CHECK(glints > 100);
}

}  // namespace firn::test::sparkle
