// SPDX-License-Identifier: MIT
// The snow as a medium: the kernel that has rays collide in it against the optical depth of the twin. Of rays
// of optical depth T a share of exp(-T) must pass; and of those that collide, the depth at which they do must
// be exponential, cut off at T.
#include <Eigen/Geometry>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "src/core/parallel.h"
#include "src/core/rng.h"
#include "tests/catch.h"
#include "tests/threads.h"
#include "tests/trace/medium_scene.h"

namespace firn::test::medium {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr int kKeys = 8;               // flights along each ray
constexpr std::size_t kTogether = 32;  // rays whose passes are counted as one
constexpr int kBins = 40;

// Of the k-th flights: hashes, and plain numbers in either half of the key.
std::vector<std::uint64_t> keys_of_flight(std::size_t count, std::uint64_t seed, std::uint64_t k) {
  std::vector<std::uint64_t> keys = keys_of(count, hash_keys(seed, k));
  for (std::size_t i = 0; i < count && k % 4 >= 2; ++i)
    keys[i] = k % 4 == 2 ? k << 32 | (i + seed) : (i + seed) << 32 | k;
  return keys;
}

struct Judgement {
  std::vector<double> z;  // of the passes of kTogether rays
  double all = 0;         // the same of all rays
  std::vector<double> bins = std::vector<double>(kBins, 0.);
  double flown = 0, expected = 0, variance = 0;  // optical depths and what they should be
  double wrong = 0;                              // collisions that cannot be, but for rounding
  double collisions = 0;

  double rms() const {
    double sum = 0;
    for (const double v : z) sum += v * v;
    return std::sqrt(sum / static_cast<double>(z.size()));
  }
  double largest() const {
    double most = 0;
    for (const double v : z) most = std::max(most, std::fabs(v));
    return most;
  }
  // Of the bins, as a normal deviate (Wilson and Hilferty).
  double chi2() const {
    double sum = 0, all = 0;
    for (const double count : bins) all += count;
    for (const double count : bins) sum += std::pow(count - all / kBins, 2) / (all / kBins);
    const double k = kBins - 1, spread = 2 / (9 * k);
    return (std::cbrt(sum / k) - (1 - spread)) / std::sqrt(spread);
  }
};

// All rays fly kKeys times.
Judgement judge(const Scene& scene, const RayStream& asked, std::uint64_t seed) {
  Judgement out;
  const std::size_t count = asked.size();
  std::vector<double> depth(count), passes(count, 0.), at(count);
  parallel_for(count, 64, [&](std::size_t i) { depth[i] = scene.depth(asked, i, asked.t(i)); });
  for (int k = 0; k < kKeys; ++k) {
    RayStream rays = asked;
    scene.collide(rays, keys_of_flight(count, seed, static_cast<std::uint64_t>(k)));
    for (std::size_t i = 0; i < count; ++i) {
      const bool passed = rays.hit(i) == kernels::kNoHit;
      passes[i] += passed;
      out.collisions += !passed;
      out.wrong += passed ? rays.t(i) != asked.t(i)
                          : !(rays.t(i) >= 0 && rays.t(i) <= asked.t(i) && depth[i] > 0 && rays.hit(i) <= 1);
    }
    parallel_for(count, 64, [&](std::size_t i) { at[i] = scene.depth(asked, i, rays.t(i)); });
    for (std::size_t i = 0; i < count; ++i) {
      const double pass = std::exp(-depth[i]);
      out.flown += at[i];
      out.expected += 1 - pass;
      out.variance += 1 - 2 * depth[i] * pass - pass * pass;
      if (rays.hit(i) == kernels::kNoHit) continue;
      const double share = (1 - std::exp(-at[i])) / (1 - pass);
      out.bins[static_cast<std::size_t>(std::clamp(share * kBins, 0., kBins - 1.))] += 1;
    }
  }
  double found = 0, mean = 0, variance = 0, surplus = 0, spread = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double pass = std::exp(-depth[i]);
    surplus += passes[i] - kKeys * pass;
    spread += kKeys * pass * (1 - pass);
    found += passes[i];
    mean += kKeys * pass;
    variance += kKeys * pass * (1 - pass);
    if ((i + 1) % kTogether != 0 || variance < 10) continue;
    out.z.push_back((found - mean) / std::sqrt(variance));
    found = mean = variance = 0;
  }
  out.all = surplus / std::sqrt(spread);
  return out;
}

void check(const Judgement& j, std::size_t groups) {
  INFO(j.z.size() << " groups, rms " << j.rms() << ", largest " << j.largest() << ", of all rays " << j.all
                  << ", chi2 as z " << j.chi2() << ", flown "
                  << (j.flown - j.expected) / std::sqrt(j.variance) << " sigma off, " << j.wrong << " of "
                  << j.collisions << " collisions wrong");
  CHECK(j.z.size() > groups);
  CHECK(j.rms() > 0.8);
  CHECK(j.rms() < 1.2);
  CHECK(j.largest() < 4.5);
  CHECK(std::fabs(j.all) < 4.5);
  CHECK(std::fabs(j.chi2()) < 4);
  CHECK(std::fabs(j.flown - j.expected) < 4.5 * std::sqrt(j.variance));
  // A ray may touch the snow where the twin has it pass by.
  CHECK(j.wrong <= 1e-4 * j.collisions);
}

// Rays of all kinds, and some from anywhere at the snow's own places.
RayStream all_rays(const RenderGrid& grid, std::size_t each, std::uint64_t seed) {
  RayStream all;
  for (const RayKind kind : kAllKinds) {
    const RayStream some = make_rays(grid, kind, each, hash_keys(seed, static_cast<std::uint64_t>(kind)));
    for (std::size_t i = 0; i < some.size(); ++i) all.push(some.origin(i), some.direction(i), some.t(i));
  }
  return all;
}

std::uint64_t hash_of(const RayStream& rays) {
  std::uint64_t hash = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    std::uint32_t bits;
    const float t = rays.t(i);
    std::memcpy(&bits, &t, sizeof bits);
    hash = hash_keys(hash, bits, rays.hit(i));
  }
  return hash;
}

// Mean free paths along a cell where it is thinnest; 0 if it is not all snow.
float thickness(const Scene& scene, int x, int y, int z) {
  const std::size_t cell = cell_index(scene.grid.view(), x, y, z);
  if (cell == kNoCell || (scene.medium.cell_kind[cell / 8] >> (4 * (cell % 8)) & 3) != kernels::kInside)
    return 0;
  float least = kInf;
  for (int k = 0; k < 8; ++k) {
    const int corner = corner_index((x & 3) + (k >> 2), (y & 3) + (k >> 1 & 1), (z & 3) + (k & 1));
    least = std::min(
        least, scene.medium.density[cell / 64 * kernels::kBrickCorners + static_cast<std::size_t>(corner)]);
  }
  return least * (scene.grid.view().cell * scene.medium.extinction);
}
bool deep(const Scene& scene, int x, int y, int z) {
  const std::size_t cell = cell_index(scene.grid.view(), x, y, z);
  return cell != kNoCell && scene.class_of(cell) == 1;
}

}  // namespace

TEST_CASE("rays pass through snow by exp(-optical depth) and collide where it says, on every ISA") {
  for (const auto* table : supported_kernels()) {
    for (const double optical : {0.5, 4.}) {
      INFO(table->isa << ", " << optical << " a cell");
      const Scene scene(lattice_ball(optical > 1 ? 5 : 12), {look_of(optical)}, SnowShape::smooth,
                        {.similarity = Similarity::never}, table->trace);
      CHECK_FALSE(scene.has_depth());
      check(judge(scene, all_rays(scene.grid, 3500, 101), 102), 100);
    }
  }
}

TEST_CASE("flights in deep cells are longer by 1 / (1 - g)") {
  const SnowOptics optics{.g = 0.75f};
  const Scene scene(lattice_ball(14), {look_of(4)}, SnowShape::smooth, optics);
  REQUIRE(scene.has_depth());
  check(judge(scene, all_rays(scene.grid, 3500, 111), 112), 50);
  // From the middle, no further than deep snow reaches: by the definition of the mean free path.
  const Vec3f middle = (-scene.grid.origin()).cast<float>();
  const double sigma = scene.medium.extinction * scene.field.density(middle);
  for (const bool reference : {true, false}) {
    Scene same(scene.snapshot, {look_of(4)}, SnowShape::smooth,
               {.g = 0.75f, .similarity = reference ? Similarity::never : Similarity::by_depth});
    RayStream rays;
    for (std::uint64_t i = 0; i < 100000; ++i) {
      const double z = 2 * uniform_double(hash_keys(113, i)) - 1,
                   a = 2 * M_PI * uniform_double(hash_keys(114, i));
      const double r = std::sqrt(1 - z * z);
      rays.push(middle, Vec3f(Vec3(r * std::cos(a), r * std::sin(a), z).cast<float>()), 2.f);
    }
    same.collide(rays, keys_of(rays.size(), 115));
    double collided = 0, flown = 0;
    std::set<std::uint32_t> codes;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      flown += rays.t(i);
      collided += rays.hit(i) != kernels::kNoHit;
      codes.insert(rays.hit(i));
    }
    CHECK(codes == std::set<std::uint32_t>{reference ? 0u : 1u, kernels::kNoHit});
    CHECK(flown / collided == Approx((reference ? 1 : 4) / sigma).epsilon(0.1));  // the density is uneven
  }
}

TEST_CASE("loose particles, torn snow and strays are as dense as they should be") {
  Snapshot snapshot = cloud(900, 12, 1.5);
  for (int i = 0; i < 8; ++i) add_particle(snapshot, Vec3(9 + 2 * i, 8, 7 - 3 * i), 1);  // lone ones
  for (int i = 0; i < 3; ++i) add_particle(snapshot, Vec3(4. * i - 8, 14, 0), 12);       // strays
  const Scene scene(std::move(snapshot), {look_of(2)});
  REQUIRE(scene.grid.view().stray_bundles == 1);
  CHECK(scene.medium.ball_density == Approx(400));
  RayStream rays = all_rays(scene.grid, 3500, 121);
  // Onto the lone ones and the strays.
  for (std::uint64_t i = 0; i < 8000; ++i) {
    const auto ball = static_cast<std::uint32_t>(scene.grid.size() - 1 - i % 3);
    Vec3f at = scene.grid.center(ball);
    if (i % 2 == 0) {
      const int k = static_cast<int>(i / 2 % 8);
      at = (Vec3(9 + 2 * k, 8, 7 - 3 * k) - scene.grid.origin()).cast<float>();
    }
    Vec3f from;
    for (int a = 0; a < 3; ++a)
      from[a] =
          static_cast<float>(40 * uniform_double(hash_keys(122, i, static_cast<std::uint64_t>(a))) - 20);
    rays.push(at + from, (-from).normalized(), i % 5 == 0 ? 0.9f * from.norm() : kInf);
  }
  check(judge(scene, rays, 123), 200);
}

TEST_CASE("where a loose ball reaches into the snow, the denser of the two counts") {
  // All particles are loose too, of less than the density inside and more than that at the surface; majorants
  // have room for the sum of both.
  Scene scene(lattice_ball(8), {look_of(2)}, SnowShape::smooth, {.similarity = Similarity::never});
  scene.grid.set_radii(std::vector<float>(scene.grid.size(), 0.6f));
  const std::size_t slots = scene.grid.brick_of_slot().size();
  std::vector<std::uint32_t> kinds(scene.medium.cell_kind, scene.medium.cell_kind + 8 * slots);
  for (std::uint32_t& word : kinds) word |= 0x11111111u * kernels::kHasLoose;
  const auto most = std::bit_cast<std::uint32_t>(1000 * scene.medium.extinction) & kernels::kMostExtinction;
  const std::vector<std::uint32_t> cells(slots * kernels::kCellsPerBrick, most);
  scene.medium.cell_kind = kinds.data();
  scene.medium.cell = cells.data();
  scene.medium.ball_density = 300;
  check(judge(scene, all_rays(scene.grid, 3500, 124), 125), 100);
}

TEST_CASE("in spheres the snow is its density within the balls") {
  Snapshot snapshot = cloud(900, 13, 1.5);
  add_particle(snapshot, Vec3(9, 8, 7), 1);
  add_particle(snapshot, Vec3(4, 20, 0), 12);  // a stray
  const Scene scene(std::move(snapshot), {look_of(2)}, SnowShape::spheres);
  REQUIRE(scene.grid.view().stray_bundles == 1);
  CHECK_FALSE(scene.has_depth());
  check(judge(scene, all_rays(scene.grid, 3500, 131), 132), 200);
}

TEST_CASE("where objects differ in density and grains, each has the extinction of its own") {
  Snapshot snapshot = lattice_ball(8);
  for (std::size_t i = 0; i < snapshot.size(); ++i) snapshot.object[i] = snapshot.position[0][i] > 0;
  const std::vector<SnowLook> looks = {look_of(0.4, 150), look_of(3, 500)};
  const Scene scene(std::move(snapshot), looks);
  const auto along_y = [&](double x, double to) {
    RayStream ray;
    ray.push((Vec3(x, -2, 0) - scene.grid.origin()).cast<float>(), Vec3f(0, 1, 0), kInf);
    return scene.depth(ray, 0, to);
  };
  CHECK(along_y(-4, 4) == Approx(4 / 1.6 * 0.4).epsilon(0.1));
  CHECK(along_y(4, 4) == Approx(4 / 1.6 * 3).epsilon(0.1));
  CHECK(scene.field.density((Vec3(-4, 0, 0) - scene.grid.origin()).cast<float>()) ==
        Approx(150).epsilon(0.1));
  check(judge(scene, all_rays(scene.grid, 2000, 141), 142), 60);
}

TEST_CASE("deep cells are those with snow all around, five mean free paths of it, and no others") {
  const double optical = GENERATE(1.2, 2.8, 6.);
  const Scene scene(lattice_ball(20), {look_of(optical)});
  REQUIRE(scene.has_depth());
  const auto& view = scene.grid.view();
  std::array<std::size_t, 9> found{};  // by the layers that make it deep
  std::size_t wrong = 0;
  for (int x = 0; x < view.cells[0]; ++x) {
    for (int y = 0; y < view.cells[1]; ++y) {
      for (int z = 0; z < view.cells[2]; ++z) {
        float least = kInf;  // mean free paths a cell of the layers so far
        int layers = 0;
        for (int n = 0; n <= 8 && layers == 0; ++n) {
          for (int i = -n; i <= n; ++i) {
            for (int j = -n; j <= n; ++j) {
              const bool side = std::max(std::abs(i), std::abs(j)) == n;
              for (int k = -n; k <= n && least > 0; k += side ? 1 : 2 * n)
                least = std::min(least, thickness(scene, x + i, y + j, z + k));
            }
          }
          if (n > 0 && least * static_cast<float>(n) >= 5) layers = n;
        }
        wrong += deep(scene, x, y, z) != (layers > 0);
        found[static_cast<std::size_t>(layers)] += layers > 0;
      }
    }
  }
  INFO("deep with 1 to 8 layers: " << found[1] << " " << found[2] << " " << found[3] << " " << found[4] << " "
                                   << found[5] << " " << found[6] << " " << found[7] << " " << found[8]);
  CHECK(wrong == 0);
  CHECK(std::accumulate(found.begin(), found.end(), std::size_t{0}) > 50);
}

TEST_CASE("thin snow, reference light and no particles have no deep cells") {
  CHECK_FALSE(Scene(lattice_ball(12), {look_of(0.3)}).has_depth());
  CHECK_FALSE(Scene(lattice_ball(12), {look_of(4)}, SnowShape::smooth, {.similarity = Similarity::never})
                  .has_depth());
  CHECK_FALSE(Scene(lattice_ball(12), {look_of(0)}).has_depth());
  for (const SnowShape shape : {SnowShape::smooth, SnowShape::spheres}) {
    const Scene empty(Snapshot{}, {look_of(4)}, shape);
    RayStream rays;
    rays.push(Vec3f(0, 0, 0), Vec3f(0, 0, 1), kInf);
    rays.push(Vec3f(1, -5, 0), Vec3f(0, 1, 0), 7.f);
    empty.collide(rays, keys_of(2, 1));
    CHECK(rays.hit(0) == kernels::kNoHit);
    CHECK(rays.hit(1) == kernels::kNoHit);
    CHECK(rays.t(1) == 7.f);
  }
}

TEST_CASE("collisions have the same bits on v3 and v4, for any split, any threads and any room for lists") {
  Snapshot snapshot = cloud(4000, 14, 2);
  for (int i = 0; i < 3; ++i) add_particle(snapshot, Vec3(4. * i - 8, 20, 0), 40);
  for (const SnowShape shape : {SnowShape::smooth, SnowShape::spheres}) {
    std::vector<std::uint64_t> hashes;
    for (const auto* table : supported_kernels()) {
      if (std::string(table->isa) == "base") continue;
      for (const int threads : {1, 2, 4}) {
        test::with_threads(threads, [&] {
          const Scene scene(snapshot, {look_of(4)}, shape, {}, table->trace);
          const RayStream asked = all_rays(scene.grid, 1000, 151);
          const auto keys = keys_of(asked.size(), 152);
          RayStream whole = asked, parts = asked, roomless = asked;
          kernels::TraceGrid view = scene.field.view();
          parallel_chunks(parts.size(), 37 * static_cast<std::size_t>(threads),
                          [&](std::size_t, std::size_t begin, std::size_t end) {
                            table->trace.collide(view, scene.medium, parts.view(), keys.data(), nullptr,
                                                 begin, end);
                          });
          scene.collide(whole, keys);
          const Scene fresh(snapshot, {look_of(4)}, shape, {}, table->trace);
          view = fresh.field.view();
          view.list_room = 0;
          table->trace.collide(view, fresh.medium, roomless.view(), keys.data(), nullptr, 0, roomless.size());
          for (const RayStream* rays : {&whole, &parts, &roomless}) hashes.push_back(hash_of(*rays));
        });
      }
    }
    for (const std::uint64_t hash : hashes) CHECK(hash == hashes[0]);
  }
}

TEST_CASE("rays with odd beginnings and ends stay within their reach") {
  const Scene scene(lattice_ball(6), {look_of(4)}, SnowShape::smooth, {.similarity = Similarity::never});
  const float cell = scene.grid.view().cell;
  const Vec3f middle = (-scene.grid.origin()).cast<float>();
  RayStream rays;
  for (int x = 0; x <= scene.grid.view().cells[0]; ++x) {
    for (int k = 0; k < 27; ++k) {
      if (k == 13) continue;
      const Vec3f d = Vec3f(static_cast<float>(k / 9 - 1), static_cast<float>(k / 3 % 3 - 1),
                            static_cast<float>(k % 3 - 1))
                          .normalized();
      for (const float reach : {0.f, 1e-30f, 0.01f, 0.3f * cell, 2.f, kInf}) {
        rays.push(Vec3f(static_cast<float>(x) * cell, middle[1], middle[2]), d, reach);  // on a face
        rays.push(cell * Vec3f(static_cast<float>(x), 8, 4), d, reach);                  // on corners
        rays.push(middle - 100 * d, d, reach);
      }
    }
  }
  const RayStream asked = rays;
  scene.collide(rays, keys_of(rays.size(), 161));
  std::size_t collided = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (rays.hit(i) == kernels::kNoHit) {
      REQUIRE(rays.t(i) == asked.t(i));
      continue;
    }
    ++collided;
    REQUIRE(rays.hit(i) == 0);
    REQUIRE(rays.t(i) >= 0);
    REQUIRE(rays.t(i) <= asked.t(i));
    REQUIRE((rays.at_hit(i) - middle).norm() < 9);
  }
  CHECK(collided > rays.size() / 10);
  check(judge(scene, asked, 162), 30);
}

}  // namespace firn::test::medium
