// SPDX-License-Identifier: MIT
#include "src/render/snow/render_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "src/core/parallel.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kCellMargin;
using kernels::kCellsPerBrick;

constexpr std::size_t kSortChunks = 32;  // at most; each counts all bricks
constexpr int kMaxClearance = 15;        // bricks
// Room for lists: one unit (64 bytes) for so many balls of the grid. Cells that find none left are read by
// centre.
constexpr std::size_t kBallsPerUnit = 7;
constexpr float kFieldReach = 2.5f;  // cells: P2G's weights reach 1.5, and the corners there fill one more

}  // namespace

// Chebyshev distance to the nearest occupied brick, one axis at a time:
// D(i) = min over k of max(|k|, D'(i + k)).
void measure_clearance(const int bricks[3], std::vector<std::int32_t>& slot) {
  const std::size_t strides[3] = {static_cast<std::size_t>(bricks[1]) * bricks[2],
                                  static_cast<std::size_t>(bricks[2]), 1};
  std::vector<std::uint8_t> clearance(slot.size()), before;
  for (std::size_t b = 0; b < slot.size(); ++b) clearance[b] = slot[b] < 0 ? kMaxClearance : 0;
  for (int a = 0; a < 3; ++a) {
    before = clearance;
    parallel_chunks(clearance.size(), kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const int i = static_cast<int>(b / strides[a] % bricks[a]);
        int best = before[b];
        for (int k = 1; k < best; ++k) {
          if (i >= k) best = std::min(best, std::max<int>(k, before[b - k * strides[a]]));
          if (i + k < bricks[a]) best = std::min(best, std::max<int>(k, before[b + k * strides[a]]));
        }
        clearance[b] = static_cast<std::uint8_t>(best);
      }
    });
  }
  for (std::size_t b = 0; b < slot.size(); ++b) {
    if (slot[b] < 0) slot[b] = -static_cast<std::int32_t>(clearance[b]);
  }
}

// The view of an empty table of these cells.
void RenderGrid::open_view() {
  view_ = {};
  view_.cell = static_cast<float>(layout_.cell);
  view_.inv_cell = 1 / view_.cell;
  for (int a = 0; a < 3; ++a) {
    view_.bricks[a] = layout_.bricks[a];
    view_.cells[a] = kBrickCells * layout_.bricks[a];
  }
}

// Of each particle the brick (in the table) and the cell in it; marks the bricks.
void RenderGrid::find_cells(const Snapshot& snapshot) {
  const std::size_t bricks = bricks_in_table();
  slot_.assign(bricks + 1, -kMaxClearance);  // the last for strays
  const float* const position[3] = {snapshot.position[0].data(), snapshot.position[1].data(),
                                    snapshot.position[2].data()};
  parallel_chunks(snapshot.size(), kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    kernels_.cell_codes(view_, position, layout_.shift, begin, end, code_);
    if (!layout_.radii_fit) {
      BallSizes sizes = layout_.sizes;
      for (std::size_t i = begin; i < end; ++i) {
        if (!(sizes.radius(snapshot, i) <= layout_.largest_radius()))
          code_[i] = static_cast<std::uint32_t>(bricks << 6);
      }
    }
    for (std::size_t i = begin; i < end; ++i)
      std::atomic_ref<std::int32_t>(slot_[code_[i] >> 6]).store(0, std::memory_order_relaxed);
  });
}

// In table order; strays sort as one brick more.
void RenderGrid::number_bricks() {
  brick_of_slot_.clear();
  for (std::size_t b = 0; b + 1 < slot_.size(); ++b) {
    if (slot_[b] < 0) continue;
    slot_[b] = static_cast<std::int32_t>(brick_of_slot_.size());
    brick_of_slot_.push_back(static_cast<std::uint32_t>(b));
  }
  slot_.back() = static_cast<std::int32_t>(brick_of_slot_.size());
}

// A stable counting sort of the particles by brick, strays last: each chunk of the snapshot counts, then each
// knows where its own go.
void RenderGrid::sort_by_brick(std::size_t count) {
  const std::size_t keys = brick_of_slot_.size() + 1;
  const std::size_t size = std::max(kParticleChunk, (count + kSortChunks - 1) / kSortChunks);
  const std::size_t chunks = (count + size - 1) / size;
  std::vector<std::uint32_t> next(chunks * keys, 0);
  parallel_chunks(count, size, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::uint32_t* counts = &next[chunk * keys];
    for (std::size_t i = begin; i < end; ++i) ++counts[slot_[code_[i] >> 6]];
  });
  brick_start_.resize(keys + 1);
  std::uint32_t sum = 0;
  for (std::size_t key = 0; key < keys; ++key) {
    brick_start_[key] = sum;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) sum += std::exchange(next[chunk * keys + key], sum);
  }
  brick_start_[keys] = sum;
  order_.resize(count);
  parallel_chunks(count, size, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::uint32_t* places = &next[chunk * keys];
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t place = places[slot_[code_[i] >> 6]]++;
      order_[place] = static_cast<std::uint32_t>(i);
      cell_by_brick_[place] = static_cast<std::uint8_t>(code_[i] & 63);
    }
  });
  slot_.pop_back();
}

// Within each brick by cell; then the columns.
void RenderGrid::sort_bricks(const Snapshot& snapshot) {
  const std::size_t slots = brick_of_slot_.size(), count = snapshot.size();
  radius_.resize(layout_.sizes.alike() ? 0 : count);
  for (auto& column : x_) column.resize(count);
  cell_start_.resize(slots * kCellsPerBrick);
  std::vector<float> largest(slots, 0.f);
  const auto place = [&](std::uint32_t i, std::uint32_t s, BallSizes& sizes) {
    for (int a = 0; a < 3; ++a) x_[a][s] = snapshot.position[a][i] + layout_.shift[a];
    if (!radius_.empty()) radius_[s] = sizes.radius(snapshot, i);
  };
  parallel_chunks(slots, 16, [&](std::size_t, std::size_t first_slot, std::size_t last_slot) {
    BallSizes sizes = layout_.sizes;
    std::vector<std::uint32_t> by_brick;
    for (std::size_t slot = first_slot; slot < last_slot; ++slot) {
      const std::uint32_t begin = brick_start_[slot], end = brick_start_[slot + 1];
      by_brick.assign(&order_[begin], &order_[begin] + (end - begin));
      const std::uint8_t* cell = &cell_by_brick_[begin];
      std::uint32_t next[kCellsPerBrick] = {};
      for (std::size_t k = 0; k < by_brick.size(); ++k) ++next[cell[k]];
      std::uint32_t sum = begin;
      for (int c = 0; c < kCellsPerBrick; ++c) {
        cell_start_[slot * kCellsPerBrick + c] = sum;
        sum += std::exchange(next[c], sum);
      }
      for (std::size_t k = 0; k < by_brick.size(); ++k) {
        const std::uint32_t s = next[cell[k]]++;
        order_[s] = by_brick[k];
        place(by_brick[k], s, sizes);
      }
      for (std::uint32_t s = begin; s < end && !radius_.empty(); ++s)
        largest[slot] = std::max(largest[slot], radius_[s]);
    }
  });
  if (layout_.sizes.alike()) view_.max_radius = layout_.sizes.radius(snapshot, 0);
  for (const float radius : largest) view_.max_radius = std::max(view_.max_radius, radius);
  BallSizes sizes = layout_.sizes;
  for (std::uint32_t k = brick_start_[slots]; k < count; ++k) place(order_[k], k, sizes);
  view_.x = x_[0].data();
  view_.y = x_[1].data();
  view_.z = x_[2].data();
  view_.radius = radius_.empty() ? nullptr : radius_.data();
  view_.cell_start = cell_start_.data();
}

// Balls within `reach` of a brick's side reach into its neighbours, which then need cells too.
void RenderGrid::open_touched_bricks(float reach) {
  const std::size_t slots = brick_of_slot_.size();
  const int layers = std::min(static_cast<int>(reach * view_.inv_cell + kCellMargin) + 1, kBrickCells);
  // Of a brick's 64 cells those that lie within `layers` of its lower and upper side along each axis.
  std::uint64_t near[3][3] = {};
  for (int c = 0; c < kCellsPerBrick; ++c) {
    const int at[3] = {c >> 4, c >> 2 & 3, c & 3};
    for (int a = 0; a < 3; ++a) {
      near[a][0] |= std::uint64_t{at[a] < layers} << c;
      near[a][1] |= std::uint64_t{1} << c;
      near[a][2] |= std::uint64_t{at[a] >= kBrickCells - layers} << c;
    }
  }
  constexpr std::int32_t kTouched = INT32_MIN;
  occupied_.resize(slots);
  parallel_for(slots, 16, [&](std::size_t slot) {
    std::uint64_t occupied = 0;
    const std::uint32_t* start = &cell_start_[slot * kCellsPerBrick];
    for (int c = 0; c < kCellsPerBrick; ++c) {
      const std::uint32_t end = c + 1 < kCellsPerBrick ? start[c + 1] : brick_start_[slot + 1];
      occupied |= std::uint64_t{start[c] < end} << c;
    }
    occupied_[slot] = occupied;
    int at[3];
    brick_place(view_, brick_of_slot_[slot], at);
    for (int k = 0; k < 27; ++k) {
      const int step[3] = {k / 9, k / 3 % 3, k % 3},
                p[3] = {at[0] + step[0] - 1, at[1] + step[1] - 1, at[2] + step[2] - 1};
      if ((occupied & near[0][step[0]] & near[1][step[1]] & near[2][step[2]]) == 0) continue;
      bool there = true;
      for (int a = 0; a < 3; ++a) there = there && p[a] >= 0 && p[a] < view_.bricks[a];
      if (!there) continue;
      std::atomic_ref<std::int32_t> its(slot_[brick_index(view_, p[0], p[1], p[2])]);
      if (its.load(std::memory_order_relaxed) < 0) its.store(kTouched, std::memory_order_relaxed);
    }
  });
  for (std::size_t b = 0; b < slot_.size(); ++b) {
    if (slot_[b] != kTouched) continue;
    slot_[b] = static_cast<std::int32_t>(brick_of_slot_.size());
    brick_of_slot_.push_back(static_cast<std::uint32_t>(b));
  }
  occupied_.resize(brick_of_slot_.size(), 0);
  cell_start_.reserve(brick_of_slot_.size() * kCellsPerBrick + 1);
  cell_start_.resize(brick_of_slot_.size() * kCellsPerBrick + 1, brick_start_[slots]);
  view_.cell_start = cell_start_.data();
  view_.slot = slot_.data();
}

// The room of the lists serves the sort first.
void RenderGrid::open_room(std::size_t count) {
  const std::size_t room = std::min<std::size_t>(count / kBallsPerUnit + 1024, kernels::kMostUnits);
  lists_.reserve_discarding(std::max(room * kernels::kListUnit, count + count / 4 + 1));
  view_.lists = lists_.data();
  view_.list_room = room;
  code_ = reinterpret_cast<std::uint32_t*>(lists_.data());
  cell_by_brick_ = reinterpret_cast<std::uint8_t*>(code_ + count);
}

// A bit for each cell of the brick that has a ball's centre in it or in one of the 26 cells around it.
std::uint64_t RenderGrid::cells_near_balls(std::size_t slot) const {
  constexpr int kRow = kBrickCells + 2;  // with the cells beside the brick
  std::uint64_t plane[kRow] = {};        // per x: bits of y and z
  int at[3];
  brick_place(view_, brick_of_slot_[slot], at);
  const auto first = [](int step) { return step < 0 ? kBrickCells - 1 : 0; };
  const auto last = [](int step) { return step > 0 ? 0 : kBrickCells - 1; };
  for (int k = 0; k < 27; ++k) {
    const int step[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
    const std::size_t cell = cell_index(view_, kBrickCells * (at[0] + step[0]),
                                        kBrickCells * (at[1] + step[1]), kBrickCells * (at[2] + step[2]));
    if (cell == kNoCell) continue;
    const std::uint64_t its = occupied_[cell / kCellsPerBrick];
    if (its == 0) continue;
    for (int x = first(step[0]); x <= last(step[0]); ++x) {
      for (int y = first(step[1]); y <= last(step[1]); ++y) {
        const std::uint64_t row = its >> (16 * x + 4 * y) & 15;
        const std::uint64_t beside = step[2] < 0 ? row >> 3 : step[2] > 0 ? (row & 1) << 5 : row << 1;
        plane[kBrickCells * step[0] + x + 1] |= beside << (kRow * (kBrickCells * step[1] + y + 1));
      }
    }
  }
  std::uint64_t near = 0;
  for (int x = 0; x < kBrickCells; ++x) {
    std::uint64_t cells = plane[x] | plane[x + 1] | plane[x + 2];
    cells |= cells >> kRow | cells >> (2 * kRow);
    cells |= cells >> 1 | cells >> 2;
    for (int y = 0; y < kBrickCells; ++y) near |= (cells >> (kRow * y) & 15) << (16 * x + 4 * y);
  }
  return near;
}

// Cells that have no ball near are known to have an empty list. later: that is told by
// empty_unreached_lists().
void RenderGrid::open_lists(bool later) {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  list_.resize(brick_of_slot_.size() * kCellsPerBrick);
  const bool far = view_.max_radius * view_.inv_cell + kCellMargin >= 1;  // balls reach further
  parallel_for(later ? 0 : brick_of_slot_.size(), 64, [&](std::size_t slot) {
    const std::uint64_t near = far || occupied_[slot] == kAll ? kAll : cells_near_balls(slot);
    for (int c = 0; c < kCellsPerBrick; ++c)
      list_[slot * kCellsPerBrick + c] = near >> c & 1 ? kernels::kUnlisted : 0;
  });
  units_used_.assign(1, 0);
  view_.list = list_.data();
  view_.units_used = units_used_.data();
}

void RenderGrid::set_radii(const std::vector<float>& radii) {
  const std::uint32_t inside = brick_start_[brick_start_.size() - 2];
  radius_.resize(order_.size(), view_.max_radius);
  parallel_chunks(inside, kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::copy(radii.data() + begin, radii.data() + end, radius_.data() + begin);
  });
  view_.radius = radius_.data();
  empty_unreached_lists();
}

// Only cells that a ball reaches keep the right to a list.
void RenderGrid::empty_unreached_lists() {
  const std::uint32_t inside = brick_start_[brick_start_.size() - 2];
  parallel_chunks(list_.size(), kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::fill(list_.data() + begin, list_.data() + end, 0u);
  });
  parallel_chunks(inside, kParticleChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const float its = radius(static_cast<std::uint32_t>(s));
      if (!(its > 0)) continue;
      const float reach = its + 2 * kCellMargin * view_.cell;
      int low[3], high[3];
      for (int a = 0; a < 3; ++a) {
        low[a] = static_cast<int>(std::max(x_[a][s] - reach, 0.f) * view_.inv_cell);
        high[a] = static_cast<int>((x_[a][s] + reach) * view_.inv_cell);
      }
      for (int x = low[0]; x <= high[0]; ++x) {
        for (int y = low[1]; y <= high[1]; ++y) {
          for (int z = low[2]; z <= high[2]; ++z) {
            const std::size_t cell = cell_index(view_, x, y, z);
            if (cell != kNoCell)
              std::atomic_ref<std::uint32_t>(list_[cell])
                  .store(kernels::kUnlisted, std::memory_order_relaxed);
          }
        }
      }
    }
  });
}

void RenderGrid::list_strays() {
  const std::uint32_t first = brick_start_[brick_start_.size() - 2];
  strays_.clear();
  for (std::size_t s = first; s < order_.size(); ++s) {
    const std::size_t place = (s - first) % kernels::kRayLanes;
    if (place == 0) {
      strays_.emplace_back();
      std::fill(std::begin(strays_.back().r2), std::end(strays_.back().r2), -1.f);
      std::fill(std::begin(strays_.back().particle), std::end(strays_.back().particle), kernels::kNoHit);
    }
    kernels::BallBundle& bundle = strays_.back();
    bundle.x[place] = x_[0][s];
    bundle.y[place] = x_[1][s];
    bundle.z[place] = x_[2][s];
    bundle.r2[place] = radius(static_cast<std::uint32_t>(s)) * radius(static_cast<std::uint32_t>(s));
    bundle.particle[place] = static_cast<std::uint32_t>(s);
  }
  view_.strays = strays_.data();
  view_.stray_bundles = strays_.size();
}

void RenderGrid::build(const Snapshot& snapshot, const std::vector<SnowLook>& looks, bool fields) {
  layout_ = lay_out_grid(kernels_, snapshot, looks);
  open_view();
  open_room(snapshot.size());
  find_cells(snapshot);
  number_bricks();
  sort_by_brick(snapshot.size());
  sort_bricks(snapshot);
  open_touched_bricks(fields ? std::max(view_.max_radius, kFieldReach * view_.cell) : view_.max_radius);
  measure_clearance(layout_.bricks, slot_);
  open_lists(fields);
  list_strays();
}

Vec3f RenderGrid::middle() const {
  const std::size_t step = size() / 1024 + 1;
  Vec3 sum = Vec3::Zero();
  double count = 0;
  for (std::size_t s = step / 2; s < size(); s += step, ++count)
    sum += center(static_cast<std::uint32_t>(s)).cast<double>();
  return count > 0 ? Vec3f((sum / count).cast<float>()) : Vec3f(Vec3f::Zero());
}

std::size_t RenderGrid::bytes() const {
  const auto of = [](const auto& column) { return column.capacity() * sizeof(column[0]); };
  return of(slot_) + of(brick_of_slot_) + of(cell_start_) + of(list_) + of(order_) + of(x_[0]) + of(x_[1]) +
         of(x_[2]) + of(radius_) + lists_.resident_bytes() + of(strays_) + of(brick_start_) + of(occupied_);
}

}  // namespace firn
