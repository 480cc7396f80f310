// SPDX-License-Identifier: MIT
#include "src/render/render_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "src/core/parallel.h"
#include "src/core/portable_math.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kCellsPerBrick;

constexpr std::size_t kChunk = 8192;
constexpr std::size_t kSortChunks = 32;  // at most; each counts all bricks
constexpr int kMaxClearance = 15;        // bricks
constexpr std::uint32_t kStray = 0xffffffffu;
// Balls are entered in every cell within this of them, in cells: covers the rounding of a ray's walk.
constexpr float kCellMargin = 1e-3f;
// Room for lists: one bundle for so many balls of the grid. Cells that find none left are read by centre.
constexpr std::size_t kBallsPerBundle = 32;

constexpr double kCompanyReach = 2.2;  // spacings
constexpr float kCompany = 5;  // weighted neighbours on a flat face of evenly packed particles; inside 9
constexpr float kTorn = 1;     // below it a particle counts as lone: the same face stretched 1.6 times
constexpr float kLoneShare = 0.7f, kStretchedShare = 1.35f;

// A ball's share of its plain radius: from kCompany down it follows the local spacing, the count's inverse
// cube root, and below kTorn it falls to kLoneShare.
float radius_share(float company) {
  const auto spacing = static_cast<float>(portable_cbrt(kCompany / std::max(company, kTorn)));
  const float stretched = std::min(spacing, kStretchedShare);
  if (company >= 2 * kTorn) return stretched;
  const float t = company / (2 * kTorn);
  return kLoneShare + (stretched - kLoneShare) * t * t * (3 - 2 * t);
}

std::size_t brick_index(const kernels::TraceGrid& grid, int bx, int by, int bz) {
  return (static_cast<std::size_t>(bx) * grid.bricks[1] + by) * grid.bricks[2] + bz;
}
void brick_place(const kernels::TraceGrid& grid, std::size_t brick, int place[3]) {
  place[0] = static_cast<int>(brick / grid.bricks[2] / grid.bricks[1]);
  place[1] = static_cast<int>(brick / grid.bricks[2] % grid.bricks[1]);
  place[2] = static_cast<int>(brick % grid.bricks[2]);
}

}  // namespace

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
  slot_.assign(bricks_in_table(), -kMaxClearance);
  code_.resize(snapshot.size());
  parallel_chunks(snapshot.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    BallSizes sizes = layout_.sizes;
    std::uint32_t last = kStray;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f p = layout_.local(snapshot, i);
      if (!layout_.holds(p, sizes.radius(snapshot, i))) {
        code_[i] = kStray;
        continue;
      }
      int c[3];
      for (int a = 0; a < 3; ++a)
        c[a] = std::min(static_cast<int>(p[a] * view_.inv_cell), view_.cells[a] - 1);
      const auto brick = static_cast<std::uint32_t>(brick_index(view_, c[0] >> 2, c[1] >> 2, c[2] >> 2));
      code_[i] = brick << 6 | static_cast<std::uint32_t>((c[0] & 3) << 4 | (c[1] & 3) << 2 | (c[2] & 3));
      if (brick != last) std::atomic_ref<std::int32_t>(slot_[brick]).store(0, std::memory_order_relaxed);
      last = brick;
    }
  });
}

// In table order.
void RenderGrid::number_bricks() {
  brick_of_slot_.clear();
  for (std::size_t b = 0; b < slot_.size(); ++b) {
    if (slot_[b] < 0) continue;
    slot_[b] = static_cast<std::int32_t>(brick_of_slot_.size());
    brick_of_slot_.push_back(static_cast<std::uint32_t>(b));
  }
}

// A stable counting sort of the particles by brick, strays last: each chunk of the snapshot counts, then each
// knows where its own go.
void RenderGrid::sort_by_brick(std::size_t count) {
  const std::size_t slots = brick_of_slot_.size(), keys = slots + 1;
  const std::size_t size = std::max(kChunk, (count + kSortChunks - 1) / kSortChunks);
  const std::size_t chunks = (count + size - 1) / size;
  std::vector<std::uint32_t> next(chunks * keys, 0);
  const auto key_of = [&](std::size_t i) {
    return code_[i] == kStray ? slots : static_cast<std::size_t>(slot_[code_[i] >> 6]);
  };
  parallel_chunks(count, size, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::uint32_t* counts = &next[chunk * keys];
    for (std::size_t i = begin; i < end; ++i) ++counts[key_of(i)];
  });
  brick_start_.resize(keys + 1);
  std::uint32_t sum = 0;
  for (std::size_t key = 0; key < keys; ++key) {
    brick_start_[key] = sum;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) sum += std::exchange(next[chunk * keys + key], sum);
  }
  brick_start_[keys] = sum;
  by_brick_.resize(count);
  parallel_chunks(count, size, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::uint32_t* places = &next[chunk * keys];
    for (std::size_t i = begin; i < end; ++i) by_brick_[places[key_of(i)]++] = static_cast<std::uint32_t>(i);
  });
}

// Within each brick by cell; then the columns, and which bricks around it the balls of a brick reach.
void RenderGrid::sort_bricks(const Snapshot& snapshot) {
  const std::size_t slots = brick_of_slot_.size(), count = snapshot.size();
  order_.resize(count);
  radius_.resize(count);
  for (auto& column : x_) column.resize(count);
  cell_start_.resize(slots * kCellsPerBrick);
  touched_.resize(slots);
  const auto place = [&](std::uint32_t i, std::uint32_t s, BallSizes& sizes) {
    order_[s] = i;
    for (int a = 0; a < 3; ++a) x_[a][s] = snapshot.x[a][i] + layout_.shift[a];
    radius_[s] = sizes.radius(snapshot, i);
  };
  parallel_for(slots, 16, [&](std::size_t slot) {
    BallSizes sizes = layout_.sizes;
    const std::uint32_t begin = brick_start_[slot], end = brick_start_[slot + 1];
    std::uint32_t next[kCellsPerBrick] = {};
    for (std::uint32_t k = begin; k < end; ++k) ++next[code_[by_brick_[k]] & 63];
    std::uint32_t sum = begin;
    for (int c = 0; c < kCellsPerBrick; ++c) {
      cell_start_[slot * kCellsPerBrick + c] = sum;
      sum += std::exchange(next[c], sum);
    }
    for (std::uint32_t k = begin; k < end; ++k) {
      const std::uint32_t i = by_brick_[k];
      place(i, next[code_[i] & 63]++, sizes);
    }
  });
  const std::uint32_t strays = brick_start_[slots];
  BallSizes sizes = layout_.sizes;
  for (std::uint32_t k = strays; k < count; ++k) place(by_brick_[k], k, sizes);
  for (int a = 0; a < 3; ++a) (a == 0 ? view_.x : a == 1 ? view_.y : view_.z) = x_[a].data();
  view_.radius = radius_.data();
  view_.cell_start = cell_start_.data();
}

// The balls of a brick may reach into its neighbours, which then need cells too.
void RenderGrid::open_touched_bricks() {
  const std::size_t slots = brick_of_slot_.size();
  const float size = kBrickCells * view_.cell, margin = view_.cell;  // a cell more, for SnowSurface
  std::vector<float> largest(slots, 0.f);
  parallel_for(slots, 16, [&](std::size_t slot) {
    int at[3];
    brick_place(view_, brick_of_slot_[slot], at);
    const std::uint32_t begin = brick_start_[slot], end = brick_start_[slot + 1];
    const float* x[3] = {view_.x, view_.y, view_.z};
    unsigned low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    float most = 0;
    for (std::uint32_t s = begin; s < end; ++s) most = std::max(most, radius_[s]);
    for (int a = 0; a < 3; ++a) {
      float least = x[a][begin], greatest = least;
      for (std::uint32_t s = begin; s < end; ++s) {
        least = std::min(least, x[a][s]);
        greatest = std::max(greatest, x[a][s]);
      }
      low[a] = least - most - margin < static_cast<float>(at[a]) * size && at[a] > 0;
      high[a] =
          greatest + most + margin >= static_cast<float>(at[a] + 1) * size && at[a] + 1 < view_.bricks[a];
    }
    std::uint32_t bits = 0;
    for (int k = 0; k < 27; ++k) {
      const int step[3] = {k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1};
      bool reached = true;
      for (int a = 0; a < 3; ++a)
        reached = reached && (step[a] == 0 || (step[a] < 0 ? low[a] : high[a]) != 0);
      bits |= static_cast<std::uint32_t>(reached) << k;
    }
    touched_[slot] = bits;
    largest[slot] = most;
  });
  constexpr std::int32_t kTouched = INT32_MIN;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    view_.max_radius = std::max(view_.max_radius, largest[slot]);
    int at[3];
    brick_place(view_, brick_of_slot_[slot], at);
    for (int k = 0; k < 27; ++k) {
      if ((touched_[slot] >> k & 1) == 0) continue;
      std::int32_t& its =
          slot_[brick_index(view_, at[0] + k / 9 - 1, at[1] + k / 3 % 3 - 1, at[2] + k % 3 - 1)];
      if (its < 0) its = kTouched;
    }
  }
  for (std::size_t b = 0; b < slot_.size(); ++b) {
    if (slot_[b] != kTouched) continue;
    slot_[b] = static_cast<std::int32_t>(brick_of_slot_.size());
    brick_of_slot_.push_back(static_cast<std::uint32_t>(b));
  }
  cell_start_.resize(brick_of_slot_.size() * kCellsPerBrick + 1, brick_start_[slots]);
  view_.cell_start = cell_start_.data();
  view_.slot = slot_.data();
}

// Chebyshev distance to the nearest occupied brick, one axis at a time:
// D(i) = min over k of max(|k|, D'(i + k)).
void RenderGrid::measure_clearance() {
  const std::size_t strides[3] = {static_cast<std::size_t>(view_.bricks[1]) * view_.bricks[2],
                                  static_cast<std::size_t>(view_.bricks[2]), 1};
  std::vector<std::uint8_t> clearance(slot_.size()), before;
  for (std::size_t b = 0; b < slot_.size(); ++b) clearance[b] = slot_[b] < 0 ? kMaxClearance : 0;
  for (int a = 0; a < 3; ++a) {
    before = clearance;
    parallel_chunks(clearance.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const int i = static_cast<int>(b / strides[a] % view_.bricks[a]);
        int best = before[b];
        for (int k = 1; k < best; ++k) {
          if (i >= k) best = std::min(best, std::max<int>(k, before[b - k * strides[a]]));
          if (i + k < view_.bricks[a]) best = std::min(best, std::max<int>(k, before[b + k * strides[a]]));
        }
        clearance[b] = static_cast<std::uint8_t>(best);
      }
    });
  }
  for (std::size_t b = 0; b < slot_.size(); ++b) {
    if (slot_[b] < 0) slot_[b] = -static_cast<std::int32_t>(clearance[b]);
  }
}

// A brick is core if balls fill it and two cells around it: nearly all of these cells hold one. Rays that
// start in the open end before they reach it.
void RenderGrid::find_core() {
  constexpr int kShell = 2, kSide = kBrickCells + 2 * kShell, kEmptyAllowed = 8;  // cells
  core_.resize(brick_of_slot_.size());
  parallel_for(core_.size(), 64, [&](std::size_t slot) {
    const std::size_t brick = brick_of_slot_[slot];
    const int corner[3] = {static_cast<int>(brick / view_.bricks[2] / view_.bricks[1]) * kBrickCells - kShell,
                           static_cast<int>(brick / view_.bricks[2] % view_.bricks[1]) * kBrickCells - kShell,
                           static_cast<int>(brick % view_.bricks[2]) * kBrickCells - kShell};
    int empty = 0;
    for (int i = 0; i < kSide * kSide * kSide && empty <= kEmptyAllowed; ++i) {
      const std::size_t cell = cell_index(view_, corner[0] + i / (kSide * kSide),
                                          corner[1] + i / kSide % kSide, corner[2] + i % kSide);
      empty += cell == kNoCell || cell_start_[cell] == cell_start_[cell + 1];
    }
    core_[slot] = empty <= kEmptyAllowed;
  });
}

// Fits the balls to their surroundings. Snow that stretches stays closed until it tears: its balls grow with
// the local spacing. A lone particle is drawn near the ball of its own volume (0.62 spacings). The measure is
// the number of neighbours within 2.2 spacings, each weighted by (1 - d^2/R^2)^2, so that radii change
// smoothly in time.
void RenderGrid::fit_radii() {
  std::vector<float> share(radius_.size(), 1.f);
  parallel_for(brick_of_slot_.size(), 4, [&](std::size_t slot) {
    if (core_[slot]) return;
    const std::size_t brick = brick_of_slot_[slot];
    const int corner[3] = {static_cast<int>(brick / view_.bricks[2] / view_.bricks[1]) * kBrickCells,
                           static_cast<int>(brick / view_.bricks[2] % view_.bricks[1]) * kBrickCells,
                           static_cast<int>(brick % view_.bricks[2]) * kBrickCells};
    for (int c = 0; c < kCellsPerBrick; ++c) {
      const int cell[3] = {corner[0] + (c >> 4), corner[1] + (c >> 2 & 3), corner[2] + (c & 3)};
      const std::size_t place = slot * kCellsPerBrick + c;
      for (std::uint32_t s = cell_start_[place]; s < cell_start_[place + 1]; ++s) {
        share[s] = radius_share(count_neighbours(cell, s));
      }
    }
  });
  view_.max_radius = 0;
  for (std::size_t s = 0; s < share.size(); ++s) {
    radius_[s] *= share[s];
    if (s < brick_start_[brick_start_.size() - 2]) view_.max_radius = std::max(view_.max_radius, radius_[s]);
  }
}

// The weighted count of balls near ball s of this cell; stops at kCompany.
float RenderGrid::count_neighbours(const int cell[3], std::uint32_t s) const {
  const auto reach = static_cast<float>(kCompanyReach * layout_.spacing);
  float sum = 0;
  const auto add_cell = [&](int x, int y, int z) {
    const std::size_t near = cell_index(view_, cell[0] + x, cell[1] + y, cell[2] + z);
    if (near == kNoCell) return;
    for (std::uint32_t other = cell_start_[near]; other < cell_start_[near + 1]; ++other) {
      const float dx = x_[0][other] - x_[0][s], dy = x_[1][other] - x_[1][s], dz = x_[2][other] - x_[2][s];
      const float rest = 1 - (dx * dx + dy * dy + dz * dz) / (reach * reach);
      if (rest > 0 && other != s) sum += rest * rest;
    }
  };
  // The cells that touch this one hold most of the sum, and packed snow needs no others.
  for (int i = 0; i < 27; ++i) add_cell(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
  for (int i = 0; i < 125 && sum < kCompany; ++i) {
    const int x = i / 25 - 2, y = i / 5 % 5 - 2, z = i % 5 - 2;
    if (std::max({std::abs(x), std::abs(y), std::abs(z)}) == 2) add_cell(x, y, z);
  }
  return std::min(sum, kCompany);
}

void RenderGrid::open_lists() {
  list_.assign(brick_of_slot_.size() * kCellsPerBrick, kernels::kUnlisted);
  const std::size_t room = order_.size() / kBallsPerBundle + 4096;
  bundles_.resize(std::min<std::size_t>(room, kernels::kMostListed));
  bundles_used_ = 0;
  view_.list = list_.data();
  view_.bundles = bundles_.data();
  view_.bundles_used = &bundles_used_;
  view_.bundle_room = bundles_.size();
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
    bundle.r2[place] = radius_[s] * radius_[s];
    bundle.particle[place] = static_cast<std::uint32_t>(s);
  }
  view_.strays = strays_.data();
  view_.stray_bundles = strays_.size();
}

void RenderGrid::build(const Snapshot& snapshot, const std::vector<SnowLook>& looks, Radii radii) {
  layout_ = lay_out_grid(snapshot, looks);
  open_view();
  find_cells(snapshot);
  number_bricks();
  sort_by_brick(snapshot.size());
  sort_bricks(snapshot);
  open_touched_bricks();
  core_.clear();
  if (radii == Radii::fitted) {
    find_core();
    fit_radii();
  }
  measure_clearance();
  open_lists();
  list_strays();
}

std::size_t RenderGrid::bytes() const {
  const auto of = [](const auto& column) { return column.capacity() * sizeof(column[0]); };
  return of(slot_) + of(brick_of_slot_) + of(cell_start_) + of(list_) + of(order_) + of(x_[0]) + of(x_[1]) +
         of(x_[2]) + of(radius_) + of(core_) + of(bundles_) + of(strays_) + of(code_) + of(by_brick_) +
         of(brick_start_) + of(touched_);
}

}  // namespace firn
