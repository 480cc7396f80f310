// SPDX-License-Identifier: MIT
// Walks: rays that scatter in the snow on their way. In light that is the same from all sides the radiance is
// the same everywhere and in all directions, whatever the medium; so walks that enter a ball evenly over its
// surface collide 4 / S times the integral of the extinction on average (S the ball's surface), and leave it
// with a mean cosine of 2/3.
#include <Eigen/Geometry>

#include <bit>
#include <cmath>

#include "tests/catch.h"
#include "tests/trace/medium_scene.h"

namespace firn::test::walks {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kShare = 0.25f;

SnowOptics walking(std::function<bool(const Vec3f&, const Vec3f&)> shared) {
  return {.g = 1 - kShare, .similarity = Similarity::by_collisions, .shared = std::move(shared)};
}
bool nowhere(const Vec3f&, const Vec3f&) { return false; }

double number(std::uint64_t seed, std::uint64_t i, std::uint64_t k) {
  return uniform_double(hash_keys(seed, i, k));
}
Vec3 even_direction(std::uint64_t seed, std::uint64_t i) {
  const double z = 2 * number(seed, i, 0) - 1, a = 2 * M_PI * number(seed, i, 1), r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

struct Around {
  Vec3 center;
  double radius;
};
Around around_snow(const Scene& scene) {
  const auto& view = scene.grid.view();
  const Vec3 half = 0.5 * Vec3(view.cells[0], view.cells[1], view.cells[2]) * static_cast<double>(view.cell);
  return {half, half.norm()};
}

// Rays that enter the ball as light does that comes from all sides.
RayStream entering(const Around& ball, std::size_t count, std::uint64_t seed) {
  RayStream rays;
  for (std::uint64_t i = 0; i < count; ++i) {
    const Vec3 out = even_direction(seed, i), side = out.unitOrthogonal(), other = out.cross(side);
    const double r = std::sqrt(number(seed, i, 2)), a = 2 * M_PI * number(seed, i, 3);
    const Vec3 in = r * std::cos(a) * side + r * std::sin(a) * other - std::sqrt(1 - r * r) * out;
    rays.push((ball.center + ball.radius * out).cast<float>(), in.cast<float>(), kInf);
  }
  return rays;
}

struct Tally {
  double collisions = 0, spread = 0;  // mean of a walk, standard error of that
  double cosine = 0, cosine_spread = 0;
  std::size_t steps = 0;  // until all had left
  double in_kernel = 0;   // share of the collisions after which the kernel went on
  // Collisions drawn to be lit, each counted by the inverse of its chance, less all collisions; its variance.
  double lit_error = 0, lit_variance = 0;
  std::size_t out_of_order = 0;

  void lit(double chance) {
    lit_error += 1 / chance;
    lit_variance += (1 - chance) / (chance * chance);
  }
};

// A walk's collisions must be listed in their order, and lie before its end.
void tally_lit(const LitCollisions& lit, const RayStream& rays, const float* chance, Tally& tally) {
  std::vector<int> last(rays.size(), 0);
  for (const kernels::LitCollision& one : lit.all()) {
    const int times = walked_times(one.scattered);
    tally.out_of_order += times <= last[one.ray] || times > rays.scattered(one.ray);
    last[one.ray] = times;
    tally.lit(chance[walked_class(one.scattered)]);
  }
}

// Follows walks to their ends: where the kernel stops they are turned here.
template <class Check>
Tally follow(const Scene& scene, std::size_t count, std::uint64_t seed, Check&& check) {
  const Around ball = around_snow(scene);
  RayStream rays = entering(ball, count, seed);
  std::vector<double> collisions(count, 0.);
  std::vector<std::size_t> of(count);
  for (std::size_t i = 0; i < count; ++i) of[i] = i;
  Tally tally;
  LitCollisions lit;
  double all = 0, squares = 0, cosines = 0, cosine_squares = 0, went_on = 0;
  for (; rays.size() > 0; ++tally.steps) {
    const auto keys = keys_of(rays.size(), hash_keys(seed, tally.steps));
    const std::vector<float> share(rays.size(), kShare);
    scene.kernels.wander(scene.field.view(), scene.medium, rays.walks(lit), keys.data(), share.data(), 0,
                         rays.size());
    tally_lit(lit, rays, scene.medium.lit, tally);
    RayStream next;
    std::vector<std::size_t> next_of;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      check(rays, i);
      collisions[of[i]] += rays.scattered(i);
      went_on += rays.scattered(i);
      if (rays.hit(i) == kernels::kNoHit) {
        const Vec3 o = rays.origin(i).cast<double>() - ball.center, d = rays.direction(i).cast<double>();
        const double along = -o.dot(d);
        const Vec3 end =
            o + (along + std::sqrt(along * along - o.squaredNorm() + ball.radius * ball.radius)) * d;
        const double cosine = end.dot(d) / ball.radius;
        cosines += cosine, cosine_squares += cosine * cosine;
        continue;
      }
      collisions[of[i]] += 1;
      if ((rays.hit(i) & kernels::kUnlit) == 0) tally.lit(scene.medium.lit[rays.hit(i) & kernels::kClass]);
      next.push(rays.at_hit(i), even_direction(hash_keys(seed, 77, tally.steps), i).cast<float>(), kInf);
      next_of.push_back(of[i]);
    }
    rays = std::move(next);
    of = std::move(next_of);
  }
  const auto n = static_cast<double>(count);
  for (const double c : collisions) all += c, squares += c * c;
  tally.collisions = all / n;
  tally.spread = std::sqrt((squares / n - tally.collisions * tally.collisions) / n);
  tally.cosine = cosines / n;
  tally.cosine_spread = std::sqrt((cosine_squares / n - tally.cosine * tally.cosine) / n);
  tally.in_kernel = went_on / all;
  tally.lit_error -= all;
  return tally;
}

void check_even(const Scene& scene, const Tally& tally) {
  const double surface = 4 * M_PI * std::pow(around_snow(scene).radius, 2);
  const double expected = 4 * kShare * scene.medium.extinction * scene.field.medium_mass() / surface;
  INFO(tally.collisions << " +- " << tally.spread << " of " << expected << ", cosine " << tally.cosine
                        << " +- " << tally.cosine_spread << ", " << tally.steps << " steps, "
                        << tally.in_kernel << " in the kernel");
  // The mass is summed over points of cells: some 0.1 %.
  CHECK(std::fabs(tally.collisions - expected) < 4 * tally.spread + 2e-3 * expected);
  CHECK(tally.spread < 0.01 * expected);
  CHECK(std::fabs(tally.cosine - 2. / 3) < 4 * tally.cosine_spread);
}

}  // namespace

TEST_CASE("walks collide as often as light in a body must, leave it evenly, and are lit by their chance") {
  for (const auto* table : supported_kernels()) {
    INFO(table->isa);
    Scene scene(lattice_ball(9), {look_of(4)}, SnowShape::smooth, walking(nowhere), table->trace);
    const Tally tally = follow(scene, 300000, 201, [](const RayStream&, std::size_t) {});
    check_even(scene, tally);
    CHECK(tally.in_kernel > 0.8);
    INFO(tally.lit_error << " lit too many, +- " << std::sqrt(tally.lit_variance));
    CHECK(tally.lit_variance > 1e4);
    CHECK(std::fabs(tally.lit_error) < 4 * std::sqrt(tally.lit_variance));
    CHECK(tally.out_of_order == 0);
  }
}

TEST_CASE("walks that are lit or scatter as often as they may come back and can be followed on") {
  const float always[8] = {1, 1, 1, 1, 1, 1, 1, 1}, never[8] = {};
  for (const bool lit : {true, false}) {
    Scene scene(lattice_ball(9), {look_of(4)}, SnowShape::smooth, walking(nowhere));
    scene.medium.lit = lit ? always : never;
    if (!lit) scene.medium.most_scattered = 3;
    const Tally tally = follow(scene, 300000, 208, [&](const RayStream& rays, std::size_t i) {
      REQUIRE(rays.scattered(i) <= static_cast<int>(lit ? kernels::kMostLit : 3));
    });
    check_even(scene, tally);
    CHECK(tally.steps > 3);
    CHECK(tally.out_of_order == 0);
    if (lit) CHECK(tally.lit_error == 0);  // all are
  }
}

TEST_CASE("walks come back to the caller where something else than snow may be on their flight") {
  const auto shared = [](const Vec3f&, const Vec3f& high) { return high.x() > 15; };
  Scene scene(lattice_ball(9), {look_of(4)}, SnowShape::smooth, walking(shared));
  const float never[8] = {}, side = kernels::kBrickCells * scene.grid.view().cell;
  scene.medium.lit = never;
  const float open = side * std::floor(15 / side);  // bricks before this
  std::size_t stopped = 0, wrong = 0, within = 0;
  const Tally tally = follow(scene, 300000, 202, [&](const RayStream& rays, std::size_t i) {
    if (rays.scattered(i) > 0) {
      ++within;
      wrong += rays.origin(i).x() > open * 1.00001f;  // it went on from there alone
    }
    if (rays.hit(i) == kernels::kNoHit) return;
    ++stopped;
    wrong += (rays.hit(i) & kernels::kUnlit) == 0;
    // A flight from open cells to open cells has passed no others, the border being flat.
    const bool tired = rays.scattered(i) >= static_cast<int>(scene.medium.most_scattered);
    wrong += rays.scattered(i) > 0 && !tired && rays.at_hit(i).x() < open * 0.99999f;
  });
  check_even(scene, tally);
  CHECK(stopped > 10000);
  CHECK(within > 10000);
  CHECK(wrong == 0);
  // Nothing known of other things: every collision comes back.
  const Scene closed(lattice_ball(9), {look_of(4)}, SnowShape::smooth, walking(nullptr));
  const Tally all = follow(closed, 300000, 203, [](const RayStream&, std::size_t) {});
  CHECK(all.in_kernel == 0);
  check_even(closed, all);
}

TEST_CASE("rays to which all of the extinction counts collide as ever among walks") {
  const Scene scene(lattice_ball(9), {look_of(4)}, SnowShape::smooth, walking(nowhere));
  const Around ball = around_snow(scene);
  RayStream walks = entering(ball, 4000, 204), plain = walks;
  const auto keys = keys_of(walks.size(), 205);
  std::vector<float> share(walks.size(), 1.f);
  for (std::size_t i = 0; i < share.size(); i += 2) share[i] = kShare;
  LitCollisions lit;
  scene.kernels.wander(scene.field.view(), scene.medium, walks.walks(lit), keys.data(), share.data(), 0,
                       walks.size());
  scene.collide(plain, keys);
  for (std::size_t i = 1; i < share.size(); i += 2) {
    REQUIRE(walks.scattered(i) == 0);
    REQUIRE(walks.hit(i) == plain.hit(i));
    REQUIRE(walks.t(i) == plain.t(i));
    REQUIRE(walks.origin(i) == plain.origin(i));
  }
}

TEST_CASE("walks have the same bits on v3 and v4 and for any split") {
  const Snapshot snapshot = lattice_ball(9);
  std::vector<std::uint64_t> hashes;
  for (const auto* table : supported_kernels()) {
    if (std::string(table->isa) == "base") continue;
    const Scene scene(snapshot, {look_of(4)}, SnowShape::smooth, walking(nowhere), table->trace);
    for (const std::size_t part : {5000, 37}) {
      RayStream rays = entering(around_snow(scene), 5000, 206);
      const auto keys = keys_of(rays.size(), 207);
      const std::vector<float> share(rays.size(), kShare);
      LitCollisions lit;
      const kernels::WalkView view = rays.walks(lit);
      for (std::size_t begin = 0; begin < rays.size(); begin += part)
        scene.kernels.wander(scene.field.view(), scene.medium, view, keys.data(), share.data(), begin,
                             std::min(begin + part, rays.size()));
      std::uint64_t hash = 0;
      for (const kernels::LitCollision& one : lit.all()) {  // of one ray in order, among one another in any
        std::uint64_t its = hash_keys(one.ray, one.scattered);
        for (const float p : one.p) its = hash_keys(its, std::bit_cast<std::uint32_t>(p));
        hash += its;
      }
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Vec3f o = rays.origin(i), d = rays.direction(i);
        const float numbers[7] = {o[0], o[1], o[2], d[0], d[1], d[2], rays.t(i)};
        for (const float one : numbers) hash = hash_keys(hash, std::bit_cast<std::uint32_t>(one));
        hash = hash_keys(hash, rays.hit(i), static_cast<std::uint64_t>(rays.scattered(i)));
      }
      hashes.push_back(hash);
    }
  }
  for (const std::uint64_t hash : hashes) CHECK(hash == hashes[0]);
}

}  // namespace firn::test::walks
