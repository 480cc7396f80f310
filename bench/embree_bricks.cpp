// SPDX-License-Identifier: MIT
#include "bench/embree_bricks.h"

#include <algorithm>
#include <atomic>

#include "firn/error.h"
#include "src/core/parallel.h"

namespace firn::bench {

namespace {

constexpr std::size_t kChunk = 16384;
// Of a brick, in particle spacings (8 particles a cell). Whole frames are fastest with it: smaller bricks
// trace up to 5 % faster and take up to twice as long to build, larger ones lose more in tracing than they
// save.
constexpr double kEdge = 3.6;
constexpr std::uint32_t kMostInBrick = (1u << kBrickBallBits) - 1;
constexpr std::size_t kOverrun = 16;  // floats that loads may read behind the last ball

BrickCallbacks callbacks_of(const std::string& isa) {
  if (isa == "x86-64-v4") return isa_v4::brick_callbacks();
  if (isa == "x86-64-v3") return isa_v3::brick_callbacks();
  return isa_base::brick_callbacks();
}

}  // namespace

EmbreeBricks::EmbreeBricks(const Balls& balls, const std::string& isa, int threads, BrickRays rays)
    : balls_(balls),
      rays_(rays),
      cell_of_(balls.snapshot.size()),
      rank_(balls.snapshot.size()),
      ball_(4 * balls.snapshot.size() + kOverrun),
      scene_(RTC_GEOMETRY_TYPE_USER, threads) {
  const BrickCallbacks callbacks = callbacks_of(isa);
  rtcSetGeometryUserData(scene_.geometry(), &view_);
  rtcSetGeometryBoundsFunction(scene_.geometry(), callbacks.bounds, nullptr);
  rtcSetGeometryIntersectFunction(scene_.geometry(), callbacks.intersect);
  rtcSetGeometryOccludedFunction(scene_.geometry(), callbacks.occluded);
}

// Cells over the bounds of the centres.
void EmbreeBricks::lay_out() {
  const Snapshot& s = balls_.snapshot;
  const std::size_t chunks = (s.size() + kChunk - 1) / kChunk;
  std::vector<std::array<float, 6>> parts(chunks);
  parallel_chunks(s.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    for (int a = 0; a < 3; ++a) {
      float low = s.position[a][begin], high = low;
      for (std::size_t i = begin; i < end; ++i) {
        low = std::min(low, s.position[a][i]);
        high = std::max(high, s.position[a][i]);
      }
      parts[chunk][a] = low;
      parts[chunk][3 + a] = high;
    }
  });
  inv_edge_ = static_cast<float>(1 / (kEdge * s.dx / 2));
  for (int a = 0; a < 3; ++a) {
    float low = parts[0][a], high = parts[0][3 + a];
    for (const auto& part : parts) {
      low = std::min(low, part[a]);
      high = std::max(high, part[3 + a]);
    }
    low_[a] = low;
    cells_[a] = static_cast<int>((high - low) * inv_edge_) + 1;
  }
}

void EmbreeBricks::count_balls() {
  const Snapshot& s = balls_.snapshot;
  cell_.assign(static_cast<std::size_t>(cells_[0]) * cells_[1] * cells_[2], 0);
  parallel_chunks(s.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto at = [&](int a) {
        return static_cast<std::uint32_t>((s.position[a][i] - low_[a]) * inv_edge_);
      };
      const std::uint32_t cell = (at(0) * cells_[1] + at(1)) * cells_[2] + at(2);
      cell_of_[i] = cell;
      rank_[i] = std::atomic_ref<std::uint32_t>(cell_[cell]).fetch_add(1, std::memory_order_relaxed);
    }
  });
}

void EmbreeBricks::number_bricks() {
  start_.clear();
  std::uint32_t sum = 0;
  for (std::uint32_t& cell : cell_) {
    if (cell == 0) continue;
    if (cell > kMostInBrick) throw Error(ErrorCode::failed, "embree_bricks", "too many balls in one brick");
    start_.push_back(sum);
    sum += cell;
    cell = static_cast<std::uint32_t>(start_.size() - 1);
  }
  start_.push_back(sum);
}

void EmbreeBricks::sort_balls() {
  const Snapshot& s = balls_.snapshot;
  parallel_chunks(s.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t brick = cell_[cell_of_[i]], first = start_[brick],
                          count = start_[brick + 1] - first;
      float* to = ball_.data() + 4 * std::size_t{first} + rank_[i];
      for (int a = 0; a < 3; ++a) to[a * count] = s.position[a][i];
      to[3 * count] = balls_.radius[i] * balls_.radius[i];
    }
  });
}

void EmbreeBricks::build() {
  lay_out();
  count_balls();
  number_bricks();
  sort_balls();
  view_ = {start_.data(), ball_.data()};
  rtcSetGeometryUserPrimitiveCount(scene_.geometry(), static_cast<unsigned>(start_.size() - 1));
  scene_.commit();
}

Vec3f EmbreeBricks::center(std::uint32_t hit) const {
  const std::uint32_t brick = hit >> kBrickBallBits, first = start_[brick], count = start_[brick + 1] - first;
  const float* x = ball_.data() + 4 * std::size_t{first} + (hit & kMostInBrick);
  return {x[0], x[count], x[2 * count]};
}

std::size_t EmbreeBricks::bytes() const {
  return scene_.bytes() + ball_.size() * sizeof(float) + start_.size() * sizeof(std::uint32_t);
}

}  // namespace firn::bench
