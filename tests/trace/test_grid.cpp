// SPDX-License-Identifier: MIT
// The render grid: sorting, bounds, bad input, and independence of threads.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "firn/error.h"
#include "src/core/rng.h"
#include "tests/catch.h"
#include "tests/threads.h"
#include "tests/trace/ray_cases.h"

namespace firn::test::grid {
namespace {

std::uint64_t fingerprint(const RenderGrid& grid) {
  std::uint64_t hash = 0;
  for (std::uint32_t i = 0; i < grid.size(); ++i) hash = hash_keys(hash, grid.snapshot_index(i));
  const auto& view = grid.view();
  for (std::size_t c = 0; c <= grid.brick_of_slot().size() * kernels::kCellsPerBrick; ++c)
    hash = hash_keys(hash, view.cell_start[c]);
  for (int b = 0; b < view.bricks[0] * view.bricks[1] * view.bricks[2]; ++b)
    hash = hash_keys(hash, static_cast<std::uint64_t>(view.slot[b]));
  return hash;
}

}  // namespace

TEST_CASE("the grid holds every particle once, at its place") {
  const Snapshot snapshot = cloud(3000, 5, 2);
  RenderGrid grid(best_trace());
  grid.build(snapshot, {SnowLook{}});
  std::vector<std::uint32_t> seen;
  for (std::uint32_t i = 0; i < grid.size(); ++i) {
    const std::uint32_t original = grid.snapshot_index(i);
    seen.push_back(original);
    const Vec3 world = grid.origin() + grid.center(i).cast<double>();
    REQUIRE((world - vec(snapshot.world_position(original))).norm() < 1e-5);
  }
  std::sort(seen.begin(), seen.end());
  std::vector<std::uint32_t> all(3000);
  std::iota(all.begin(), all.end(), 0);
  CHECK(seen == all);
}

TEST_CASE("the grid is the same for any number of threads") {
  const Snapshot snapshot = cloud(40000, 6, 2);
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 2, 4}) {
    test::with_threads(threads, [&] {
      RenderGrid grid(best_trace());
      grid.build(snapshot, {SnowLook{}});
      hashes.push_back(fingerprint(grid));
    });
  }
  CHECK(hashes[0] == hashes[1]);
  CHECK(hashes[0] == hashes[2]);
}

TEST_CASE("the grid is the same for every instruction set") {
  const Snapshot snapshot = cloud(20000, 16, 2);
  std::vector<std::uint64_t> hashes;
  for (const auto* table : supported_kernels()) {
    RenderGrid grid(table->trace);
    grid.build(snapshot, {SnowLook{}});
    hashes.push_back(fingerprint(grid));
  }
  for (const std::uint64_t hash : hashes) CHECK(hash == hashes[0]);
}

TEST_CASE("plain radii are what the look says") {
  const Snapshot snapshot = cloud(3000, 5, 2);
  RenderGrid grid(best_trace());
  SnowLook look;
  look.radius = 0.6;
  grid.build(snapshot, {look});
  for (std::uint32_t i = 0; i < grid.size(); ++i)
    REQUIRE(grid.radius(i) == Approx(0.6 * std::cbrt(snapshot.volume0[grid.snapshot_index(i)])));
}

TEST_CASE("balls of each cell are in the snapshot's order") {
  const Snapshot snapshot = cloud(5000, 17, 1);
  RenderGrid grid(best_trace());
  grid.build(snapshot, {SnowLook{}});
  const auto& view = grid.view();
  for (std::size_t c = 0; c < grid.brick_of_slot().size() * kernels::kCellsPerBrick; ++c) {
    REQUIRE(view.cell_start[c] <= view.cell_start[c + 1]);
    for (std::uint32_t s = view.cell_start[c] + 1; s < view.cell_start[c + 1]; ++s)
      REQUIRE(grid.snapshot_index(s - 1) < grid.snapshot_index(s));
  }
}

TEST_CASE("a grid that is built again forgets the last frame") {
  const Snapshot small = cloud(300, 7), large = cloud(5000, 8);
  RenderGrid fresh(best_trace()), used(best_trace());
  fresh.build(small, {SnowLook{}});
  used.build(large, {SnowLook{}});
  used.build(small, {SnowLook{}});
  CHECK(fingerprint(fresh) == fingerprint(used));
}

TEST_CASE("a particle that is nowhere is refused as unstable, by its id") {
  Snapshot snapshot = cloud(10, 9);
  snapshot.id[4] = 1234;
  for (const float bad : {std::nanf(""), INFINITY, -INFINITY}) {
    snapshot.position[1][4] = bad;
    RenderGrid grid(best_trace());
    try {
      grid.build(snapshot, {SnowLook{}});
      FAIL("no error");
    } catch (const Error& error) {
      CHECK(error.code() == ErrorCode::unstable);
      CHECK(std::strstr(error.what(), "1234") != nullptr);
    }
  }
}

TEST_CASE("one particle far away does not spoil the cells of the others") {
  Snapshot snapshot = cloud(20000, 10);
  RenderGrid near(best_trace()), with_far(best_trace());
  near.build(snapshot, {SnowLook{}});
  add_particle(snapshot, Vec3(2e5, -1e5, 3e5), 1);
  with_far.build(snapshot, {SnowLook{}});
  CHECK(with_far.view().cell <= 2 * near.view().cell);
  CHECK(with_far.bytes() < 2 * near.bytes() + 100'000'000);
}

}  // namespace firn::test::grid
