// SPDX-License-Identifier: MIT
#include "src/render/render_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>

#include "src/core/parallel.h"
#include "src/core/portable_math.h"
#include "src/render/cell_lists.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kCellsPerBrick;
using kernels::kNoBrick;

constexpr std::size_t kChunk = 8192;
constexpr int kMaxClearance = 15;  // bricks
// Balls are entered in every cell within this of them, in cells: covers the rounding of a ray's walk.
constexpr float kCellMargin = 1e-3f;

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

struct CellRange {
  int low[3], high[3];  // inclusive
};

// The cells of the grid that a ball's box touches.
CellRange cells_of(const kernels::TraceGrid& grid, const Vec3f& p, float reach) {
  CellRange range;
  for (int a = 0; a < 3; ++a) {
    range.low[a] =
        std::clamp(static_cast<int>(std::floor((p[a] - reach) * grid.inv_cell)), 0, grid.cells[a] - 1);
    range.high[a] =
        std::clamp(static_cast<int>(std::floor((p[a] + reach) * grid.inv_cell)), 0, grid.cells[a] - 1);
  }
  return range;
}

std::size_t brick_index(const kernels::TraceGrid& grid, int bx, int by, int bz) {
  return (static_cast<std::size_t>(bx) * grid.bricks[1] + by) * grid.bricks[2] + bz;
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

// Numbers the bricks that a ball touches, in table order.
void RenderGrid::place_bricks(const Snapshot& snapshot) {
  const std::size_t bricks = static_cast<std::size_t>(view_.bricks[0]) * view_.bricks[1] * view_.bricks[2];
  slot_.assign(bricks, kNoBrick);
  parallel_chunks(snapshot.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f p = layout_.local(snapshot, i);
      if (!layout_.holds(p, layout_.radius[i])) continue;
      const CellRange range =
          cells_of(view_, p, layout_.radius[i] + view_.cell);  // and a cell for SnowSurface
      for (int x = range.low[0] >> 2; x <= range.high[0] >> 2; ++x) {
        for (int y = range.low[1] >> 2; y <= range.high[1] >> 2; ++y) {
          for (int z = range.low[2] >> 2; z <= range.high[2] >> 2; ++z) {
            std::atomic_ref<std::uint32_t>(slot_[brick_index(view_, x, y, z)])
                .store(0, std::memory_order_relaxed);
          }
        }
      }
    }
  });
  brick_of_slot_.clear();
  for (std::size_t b = 0; b < bricks; ++b) {
    if (slot_[b] == kNoBrick) continue;
    slot_[b] = static_cast<std::uint32_t>(brick_of_slot_.size());
    brick_of_slot_.push_back(static_cast<std::uint32_t>(b));
  }
  view_.slot = slot_.data();
}

// Chebyshev distance to the nearest occupied brick, one axis at a time:
// D(i) = min over k of max(|k|, D'(i + k)).
void RenderGrid::measure_clearance() {
  clearance_.resize(slot_.size());
  for (std::size_t b = 0; b < slot_.size(); ++b) clearance_[b] = slot_[b] == kNoBrick ? kMaxClearance : 0;
  const std::size_t strides[3] = {static_cast<std::size_t>(view_.bricks[1]) * view_.bricks[2],
                                  static_cast<std::size_t>(view_.bricks[2]), 1};
  std::vector<std::uint8_t> before;
  for (int a = 0; a < 3; ++a) {
    before = clearance_;
    parallel_chunks(clearance_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const int i = static_cast<int>(b / strides[a] % view_.bricks[a]);
        int best = before[b];
        for (int k = 1; k < best; ++k) {
          if (i >= k) best = std::min(best, std::max<int>(k, before[b - k * strides[a]]));
          if (i + k < view_.bricks[a]) best = std::min(best, std::max<int>(k, before[b + k * strides[a]]));
        }
        clearance_[b] = static_cast<std::uint8_t>(best);
      }
    });
  }
}

// Counting sort of the balls by the cell of their centre; the places within a cell are put in snapshot order,
// so that the race for them leaves no trace.
void RenderGrid::sort_balls(const Snapshot& snapshot) {
  const std::size_t cells = brick_of_slot_.size() * kCellsPerBrick;
  const std::size_t stray_cell = cells;
  std::vector<std::uint32_t> cell_of(snapshot.size());
  std::vector<std::uint64_t> next(cells + 2, 0);
  parallel_chunks(snapshot.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f p = layout_.local(snapshot, i);
      std::size_t cell = stray_cell;
      if (layout_.holds(p, layout_.radius[i])) {
        const CellRange at = cells_of(view_, p, 0);
        cell = cell_index(view_, at.low[0], at.low[1], at.low[2]);
      }
      cell_of[i] = static_cast<std::uint32_t>(cell);
      std::atomic_ref<std::uint64_t>(next[cell]).fetch_add(1, std::memory_order_relaxed);
    }
  });
  cell_start_.resize(cells + 2);
  std::uint64_t sum = 0;
  for (std::size_t c = 0; c < cells + 2; ++c) {
    cell_start_[c] = sum;
    sum += next[c];
    next[c] = cell_start_[c];
  }
  order_.resize(snapshot.size());
  parallel_chunks(snapshot.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      order_[std::atomic_ref<std::uint64_t>(next[cell_of[i]]).fetch_add(1, std::memory_order_relaxed)] =
          static_cast<std::uint32_t>(i);
    }
  });
  radius_.resize(snapshot.size());
  for (auto& column : x_) column.resize(snapshot.size());
  parallel_chunks(cells + 1, kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      std::sort(order_.begin() + cell_start_[c], order_.begin() + cell_start_[c + 1]);
      for (std::uint64_t s = cell_start_[c]; s < cell_start_[c + 1]; ++s) {
        const Vec3f p = layout_.local(snapshot, order_[s]);
        for (int a = 0; a < 3; ++a) x_[a][s] = p[a];
        radius_[s] = layout_.radius[order_[s]];
      }
    }
  });
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
      for (std::uint64_t s = cell_start_[place]; s < cell_start_[place + 1]; ++s) {
        share[s] = radius_share(count_neighbours(cell, s));
      }
    }
  });
  for (std::size_t s = 0; s < share.size(); ++s) radius_[s] *= share[s];
}

// The weighted count of balls near ball s of this cell; stops at kCompany.
float RenderGrid::count_neighbours(const int cell[3], std::uint64_t s) const {
  const auto reach = static_cast<float>(kCompanyReach * layout_.spacing);
  float sum = 0;
  const auto add_cell = [&](int x, int y, int z) {
    const std::size_t near = cell_index(view_, cell[0] + x, cell[1] + y, cell[2] + z);
    if (near == kNoCell) return;
    for (std::uint64_t other = cell_start_[near]; other < cell_start_[near + 1]; ++other) {
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

// Bundles of the balls that overlap each cell: gathered by groups of bricks, then laid end to end.
void RenderGrid::fill_bundles() {
  constexpr std::size_t kGroup = 16;  // bricks
  const std::size_t slots = brick_of_slot_.size();
  std::vector<std::vector<kernels::BallBundle>> groups((slots + kGroup - 1) / kGroup);
  bundle_start_.assign(slots * kCellsPerBrick + 1, 0);
  parallel_chunks(slots, kGroup, [&](std::size_t group, std::size_t begin, std::size_t end) {
    CellLists lists;
    for (std::size_t slot = begin; slot < end; ++slot) {
      for (auto& list : lists.ball) list.clear();
      if (!core_[slot]) gather_cell_lists(view_, brick_of_slot_[slot], kCellMargin * view_.cell, lists);
      for (int c = 0; c < kCellsPerBrick; ++c) {
        const auto& ball = lists.ball[c];
        for (std::size_t i = 0; i < ball.size(); i += kernels::kRayLanes) {
          groups[group].push_back(make_bundle(view_, &ball[i], ball.size() - i));
        }
        bundle_start_[slot * kCellsPerBrick + c + 1] = groups[group].size();
      }
    }
  });
  std::vector<std::uint64_t> group_start(groups.size() + 1, 0);
  for (std::size_t g = 0; g < groups.size(); ++g) group_start[g + 1] = group_start[g] + groups[g].size();
  bundles_.resize(group_start.back());
  parallel_chunks(slots, kGroup, [&](std::size_t group, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin * kCellsPerBrick; c < end * kCellsPerBrick; ++c) {
      bundle_start_[c + 1] += group_start[group];
    }
    std::copy(groups[group].begin(), groups[group].end(), bundles_.begin() + group_start[group]);
  });
}

void RenderGrid::fill_strays() {
  const std::size_t first = cell_start_[cell_start_.size() - 2];
  std::vector<std::uint32_t> ball(order_.size() - first);
  for (std::size_t i = 0; i < ball.size(); ++i) ball[i] = static_cast<std::uint32_t>(first + i);
  strays_.clear();
  for (std::size_t i = 0; i < ball.size(); i += kernels::kRayLanes) {
    strays_.push_back(make_bundle(view_, &ball[i], ball.size() - i));
  }
}

void RenderGrid::publish() {
  view_.clearance = clearance_.data();
  view_.cell_start = cell_start_.data();
  view_.x = x_[0].data();
  view_.y = x_[1].data();
  view_.z = x_[2].data();
  view_.radius = radius_.data();
  const auto end = radius_.begin() + static_cast<std::ptrdiff_t>(cell_start_[cell_start_.size() - 2]);
  view_.max_radius = end == radius_.begin() ? 0 : *std::max_element(radius_.begin(), end);
}

void RenderGrid::build(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  layout_ = lay_out_grid(snapshot, looks);
  open_view();
  place_bricks(snapshot);
  measure_clearance();
  sort_balls(snapshot);
  publish();
  find_core();
  fit_radii();
  fill_bundles();
  fill_strays();
  view_.bundle_start = bundle_start_.data();
  view_.bundles = bundles_.data();
  view_.core = core_.data();
  view_.strays = strays_.data();
  view_.stray_bundles = strays_.size();
}

std::size_t RenderGrid::bytes() const {
  const auto of = [](const auto& column) { return column.capacity() * sizeof(column[0]); };
  return of(slot_) + of(clearance_) + of(brick_of_slot_) + of(cell_start_) + of(bundle_start_) + of(order_) +
         of(x_[0]) + of(x_[1]) + of(x_[2]) + of(radius_) + of(layout_.radius) + of(core_) + of(bundles_) +
         of(strays_);
}

}  // namespace firn
