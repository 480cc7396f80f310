// SPDX-License-Identifier: MIT
// The trace kernels of every instruction set of this CPU against the brute-force reference in double.

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/core/isa.h"
#include "src/core/parallel.h"
#include "src/core/rng.h"
#include "tests/catch.h"
#include "tests/threads.h"
#include "tests/trace/ray_cases.h"

namespace firn::test::trace {
namespace {

RenderGrid grid_of(const Snapshot& snapshot) {
  RenderGrid grid(best_trace());
  grid.build(snapshot, {SnowLook{}});
  return grid;
}

// The same grid whose lists have room for no more than so many units.
kernels::TraceGrid with_room(const RenderGrid& grid, std::uint64_t units) {
  kernels::TraceGrid view = grid.view();
  view.list_room = units;
  return view;
}

void check_all_kinds(const RenderGrid& grid, std::size_t rays, std::uint64_t seed) {
  for (const auto* table : supported_kernels()) {
    for (const RayKind kind : kAllKinds) {
      INFO(table->isa << ", kind " << static_cast<int>(kind) << ", balls " << grid.size());
      const RayStream stream = make_rays(grid, kind, rays, seed);
      CHECK(judge_closest(table->trace.closest, grid, stream) == "");
      CHECK(judge_closest(table->trace.closest_coherent, grid, stream) == "");
      CHECK(judge_occluded(table->trace.occluded, grid, stream) == "");
      CHECK(judge_occluded(table->trace.occluded_coherent, grid, stream) == "");
    }
  }
}

bool same_answers(RayStream& a, RayStream& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a.hit(i) != b.hit(i) || a.t(i) != b.t(i)) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("rays find the nearest ball that they enter, in clouds of any size") {
  for (const std::size_t count : {1, 2, 7, 16, 17, 150, 2000}) {
    check_all_kinds(grid_of(cloud(count, 11 + count)), 203, 5 + count);
  }
}

TEST_CASE("rays find the nearest ball when radii differ forty-fold") {
  Snapshot snapshot = cloud(800, 3, 3);
  for (int i = 0; i < 5; ++i) add_particle(snapshot, Vec3(4.0 * i - 8, 9, 0), 40);
  const RenderGrid grid = grid_of(snapshot);
  REQUIRE(grid.view().stray_bundles == 1);
  check_all_kinds(grid, 203, 8);
}

TEST_CASE("particles in one place are one ball") {
  Snapshot snapshot;
  for (int i = 0; i < 500; ++i) add_particle(snapshot, Vec3(1, 2, 3), 1);
  check_all_kinds(grid_of(snapshot), 101, 21);
}

TEST_CASE("two clouds far apart are both seen and the table of bricks stays small") {
  Snapshot snapshot = cloud(500, 4);
  for (int i = 0; i < 200; ++i) add_particle(snapshot, Vec3(3e4 + i % 10, 5e3 + i / 10, -2e4), 1);
  const RenderGrid grid = grid_of(snapshot);
  CHECK(grid.bytes() < 200'000'000);
  check_all_kinds(grid, 101, 22);
}

TEST_CASE("an empty grid is never hit") {
  const RenderGrid grid = grid_of(Snapshot{});
  RayStream rays;
  rays.push(Vec3f(0, 0, 0), Vec3f(0, 0, 1), std::numeric_limits<float>::infinity());
  rays.push(Vec3f(1, -5, 0), Vec3f(0, 1, 0), 7.f);
  for (const auto* table : supported_kernels()) {
    for (const auto function : {table->trace.closest, table->trace.closest_coherent, table->trace.occluded}) {
      function(grid.view(), rays.view(), 0, rays.size());
      CHECK(rays.hit(0) == kernels::kNoHit);
      CHECK(rays.hit(1) == kernels::kNoHit);
      CHECK(rays.t(1) == 7.f);
    }
  }
}

TEST_CASE("rays that start deep inside the snow find its balls") {
  const RenderGrid grid = grid_of(cloud(60000, 61, 1.5));
  for (const auto* table : supported_kernels()) {
    for (const RayKind kind : {RayKind::inside, RayKind::on_surface}) {
      const RayStream stream = make_rays(grid, kind, 101, 62);
      CHECK(judge_closest(table->trace.closest, grid, stream) == "");
      CHECK(judge_closest(table->trace.closest_coherent, grid, stream) == "");
      CHECK(judge_occluded(table->trace.occluded, grid, stream) == "");
      CHECK(judge_occluded(table->trace.occluded_coherent, grid, stream) == "");
    }
  }
}

TEST_CASE("rays find the same where there is no room for a cell's list") {
  const Snapshot snapshot = cloud(3000, 71, 2);
  for (const auto* table : supported_kernels()) {
    for (const RayKind kind : {RayKind::random, RayKind::inside}) {
      const RenderGrid roomy = grid_of(snapshot), half = grid_of(snapshot), none = grid_of(snapshot);
      RayStream a = make_rays(roomy, kind, 2000, 72), b = a, c = a;
      table->trace.closest(roomy.view(), a.view(), 0, a.size());
      REQUIRE(*roomy.view().units_used > 500);
      table->trace.closest(with_room(half, 300), b.view(), 0, b.size());
      table->trace.closest(with_room(none, 0), c.view(), 0, c.size());
      CHECK(same_answers(a, b));
      CHECK(same_answers(a, c));
    }
  }
}

TEST_CASE("any hit is the same in packets, in waves of any length and without lists") {
  const Snapshot snapshot = cloud(3000, 73, 2);
  for (const auto* table : supported_kernels()) {
    for (const RayKind kind : kAllKinds) {
      const RenderGrid grid = grid_of(snapshot), none = grid_of(snapshot);
      RayStream a = make_rays(grid, kind, 2000, 74), b = a, c = a, d = a;
      table->trace.occluded(grid.view(), a.view(), 0, a.size());
      table->trace.occluded_coherent(grid.view(), b.view(), 0, b.size());
      table->trace.occluded(with_room(none, 0), c.view(), 0, c.size());
      for (std::size_t i = 0; i < d.size(); i += 37)
        table->trace.occluded(grid.view(), d.view(), i, std::min(i + 37, d.size()));
      CHECK(same_answers(a, b));
      CHECK(same_answers(a, c));
      CHECK(same_answers(a, d));
    }
  }
}

TEST_CASE("balls of negative radius are none, whichever kernel is asked") {
  const Snapshot snapshot = cloud(3000, 75, 2);
  const RenderGrid whole = grid_of(snapshot);
  for (const auto* table : supported_kernels()) {
    RenderGrid grid = grid_of(snapshot);
    std::vector<float> radii(grid.size());
    for (std::uint32_t s = 0; s < radii.size(); ++s)
      radii[s] = hash_keys(s, 76) % 3 == 0 ? grid.radius(s) : -1.f;
    grid.set_radii(radii);
    for (const RayKind kind : kAllKinds) {
      INFO(table->isa << ", kind " << static_cast<int>(kind));
      RayStream one = make_rays(whole, kind, 2000, 77), packets = one, shadows = one, shadow_packets = one;
      table->trace.closest(grid.view(), one.view(), 0, one.size());
      table->trace.closest_coherent(grid.view(), packets.view(), 0, packets.size());
      table->trace.occluded(grid.view(), shadows.view(), 0, shadows.size());
      table->trace.occluded_coherent(grid.view(), shadow_packets.view(), 0, shadow_packets.size());
      std::size_t none = 0;
      for (std::size_t i = 0; i < one.size(); ++i)
        none += one.hit(i) != kernels::kNoHit && radii[one.hit(i)] < 0;
      CHECK(none == 0);
      CHECK(same_answers(one, packets));
      CHECK(same_answers(shadows, shadow_packets));
    }
  }
}

TEST_CASE("threads that meet in the same cells find the same") {
  const Snapshot snapshot = cloud(20000, 81, 1.5);
  const RenderGrid alone = grid_of(snapshot);
  RayStream one = make_rays(alone, RayKind::random, 20000, 82), shadows = one;
  best_trace().closest(alone.view(), one.view(), 0, one.size());
  best_trace().occluded(alone.view(), shadows.view(), 0, shadows.size());
  for (int turn = 0; turn < 5; ++turn) {
    const RenderGrid shared = grid_of(snapshot);
    RayStream many = make_rays(shared, RayKind::random, 20000, 82), blocked = many;
    test::with_threads(4, [&] {
      parallel_chunks(many.size(), 64, [&](std::size_t, std::size_t begin, std::size_t end) {
        best_trace().closest(shared.view(), many.view(), begin, end);
        best_trace().occluded(shared.view(), blocked.view(), begin, end);
      });
    });
    CHECK(same_answers(one, many));
    CHECK(same_answers(shadows, blocked));
  }
}

TEST_CASE("a million fuzzed rays against brute force") {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const RenderGrid grid =
        grid_of(cloud(1 + hash_keys(seed, 91) % 300, seed, 1 + 0.01 * static_cast<double>(seed)));
    INFO("seed " << seed);
    const RayStream rays = make_rays(grid, kAllKinds[seed % std::size(kAllKinds)], 5000, seed);
    REQUIRE(judge_closest(best_trace().closest, grid, rays) == "");
    REQUIRE(judge_closest(best_trace().closest_coherent, grid, rays) == "");
    REQUIRE(judge_occluded(best_trace().occluded, grid, rays) == "");
  }
}

TEST_CASE("the kernels of AVX2 and AVX-512 give the same bits") {
  const RenderGrid grid = grid_of(cloud(2000, 31, 2));
  const kernels::KernelTable* reference = nullptr;
  for (const auto* table : supported_kernels()) {
    if (std::string(table->isa) == "base") continue;
    if (reference == nullptr) {
      reference = table;
      continue;
    }
    for (const RayKind kind : kAllKinds) {
      RayStream a = make_rays(grid, kind, 3000, 17), b = a;
      reference->trace.closest(grid.view(), a.view(), 0, a.size());
      table->trace.closest(grid.view(), b.view(), 0, b.size());
      CHECK(same_answers(a, b));
      RayStream c = make_rays(grid, kind, 3000, 18), d = c;
      reference->trace.closest_coherent(grid.view(), c.view(), 0, c.size());
      table->trace.closest_coherent(grid.view(), d.view(), 0, d.size());
      CHECK(same_answers(c, d));
    }
  }
}

TEST_CASE("the answer for a ray does not depend on the range it is asked in") {
  const RenderGrid grid = grid_of(cloud(700, 41));
  const auto& trace = supported_kernels().back()->trace;
  for (const auto function : {trace.closest, trace.closest_coherent}) {
    RayStream whole = make_rays(grid, RayKind::random, 500, 3), parts = whole;
    function(grid.view(), whole.view(), 0, 500);
    for (const std::size_t cut : {0, 1, 17, 18, 250}) {
      const std::size_t next = cut == 0 ? 1 : cut == 1 ? 17 : cut == 17 ? 18 : cut == 18 ? 250 : 500;
      function(grid.view(), parts.view(), cut, next);
    }
    CHECK(same_answers(whole, parts));
  }
}

TEST_CASE("coherent and incoherent kernels give the same bits for camera rays") {
  const RenderGrid grid = grid_of(cloud(2000, 51));
  const auto& trace = supported_kernels().back()->trace;
  RayStream camera;
  for (int i = 0; i < 64 * 64; ++i) {
    const Vec3f d = Vec3f((i % 64 - 32) / 64.f, (i / 64 - 32) / 64.f, 1.f).normalized();
    camera.push(Vec3f(9, 9, -20), d, std::numeric_limits<float>::infinity());
  }
  CHECK(judge_closest(trace.closest_coherent, grid, camera) == "");
  RayStream coherent = camera;
  trace.closest(grid.view(), camera.view(), 0, camera.size());
  trace.closest_coherent(grid.view(), coherent.view(), 0, coherent.size());
  CHECK(same_answers(camera, coherent));
}

}  // namespace firn::test::trace
