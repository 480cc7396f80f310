// SPDX-License-Identifier: MIT
#include "src/render/render_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include "src/core/error.h"
#include "src/core/parallel.h"
#include "src/core/portable_math.h"
#include "src/render/cell_lists.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kCellsPerBrick;
using kernels::kNoBrick;

constexpr double kCellSpacings =
    1.5;  // cell edge in mean particle spacings: best of 1.2-2 on balls of 0.2-1 M
constexpr double kMaxRadiusCells = 2;     // larger balls are strays
constexpr std::size_t kMaxStrays = 1024;  // beyond this the cells grow
constexpr double kMaxBricks = 1 << 22;
constexpr std::size_t kChunk = 8192;
constexpr int kMaxClearance = 15;  // bricks
// Balls are entered in every cell within this of them, in cells: covers the rounding of a ray's walk.
constexpr float kCellMargin = 1e-3f;

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

struct Statistics {
  Bounds bounds;
  double spacing_sum = 0;
  std::size_t bad = SIZE_MAX;
};

}  // namespace

Vec3f RenderGrid::local(const Snapshot& snapshot, std::size_t i) const {
  return (snapshot.world_position(i) - origin_).cast<float>();
}

bool RenderGrid::in_cells(const Vec3f& p, float radius) const {
  if (radius > kMaxRadiusCells * view_.cell) return false;
  for (int a = 0; a < 3; ++a) {
    if (!(p[a] >= 0 && p[a] * view_.inv_cell < view_.cells[a])) return false;
  }
  return true;
}

// Radii, bounds and mean spacing.
void RenderGrid::measure(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  const std::size_t count = snapshot.size();
  ball_radius_.resize(count);
  std::vector<Statistics> parts((count + kChunk - 1) / kChunk);
  parallel_chunks(count, kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    Statistics& part = parts[chunk];
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = snapshot.world_position(i);
      const double spacing = portable_cbrt(snapshot.volume0[i]);
      if (!p.allFinite() || !std::isfinite(snapshot.volume0[i]) || p.cwiseAbs().maxCoeff() > 1e12) {
        part.bad = std::min(part.bad, i);
        continue;
      }
      const std::size_t look =
          std::min<std::size_t>(snapshot.object[i], looks.empty() ? 0 : looks.size() - 1);
      ball_radius_[i] =
          static_cast<float>(spacing * (looks.empty() ? SnowLook{}.radius : looks[look].radius));
      part.bounds.include(p);
      part.spacing_sum += spacing;
    }
  });
  Statistics all;
  for (const Statistics& part : parts) {
    all.bounds.include(part.bounds);
    all.spacing_sum += part.spacing_sum;
    all.bad = std::min(all.bad, part.bad);
  }
  if (all.bad != SIZE_MAX) {
    throw Error(
        ExitCode::unstable, "frame " + std::to_string(snapshot.frame),
        "particle " + std::to_string(snapshot.id[all.bad]) + " has no finite place or volume to draw");
  }
  bounds_ = all.bounds;
  origin_ = snapshot.origin;
  spacing_ = count == 0 ? 1 : std::max(all.spacing_sum / static_cast<double>(count), 1e-9);
}

// Lays cells of this size over the bounds.
void RenderGrid::fit(double cell) {
  view_ = {};
  view_.cell = static_cast<float>(cell);
  view_.inv_cell = 1 / view_.cell;
  if (bounds_.empty()) return;
  const double margin = kMaxRadiusCells * cell;
  origin_ = bounds_.min - Vec3::Constant(margin);
  for (int a = 0; a < 3; ++a) {
    const double bricks = std::ceil((bounds_.size()[a] + 2 * margin) / (kBrickCells * cell));
    view_.bricks[a] = static_cast<int>(std::min(bricks, 1e6));
    view_.cells[a] = kBrickCells * view_.bricks[a];
  }
}

// The bounds of all but a few outlying particles: cut where 1 % (at most 128) lie beyond on each side of each
// axis, then widened by their own size. A grid over a splash that left the scene would have no cells left for
// the snow.
void RenderGrid::trim_bounds(const Snapshot& snapshot) {
  const std::size_t count = snapshot.size(), beyond = std::min<std::size_t>(count / 100, 128);
  std::vector<float> column;
  Bounds kept = bounds_;
  for (int a = 0; a < 3; ++a) {
    column = snapshot.x[a];
    const auto low = column.begin() + static_cast<std::ptrdiff_t>(beyond);
    const auto high = column.begin() + static_cast<std::ptrdiff_t>(count - 1 - beyond);
    std::nth_element(column.begin(), low, column.end());
    const double from = *low;
    std::nth_element(column.begin(), high, column.end());
    const double size = *high - from + 16 * spacing_;
    kept.min[a] = std::max(bounds_.min[a], snapshot.origin[a] + from - size);
    kept.max[a] = std::min(bounds_.max[a], snapshot.origin[a] + *high + size);
  }
  bounds_ = kept;
}

std::size_t RenderGrid::count_strays(const Snapshot& snapshot) const {
  std::size_t strays = 0;
  for (std::size_t i = 0; i < snapshot.size(); ++i) strays += !in_cells(local(snapshot, i), ball_radius_[i]);
  return strays;
}

// Lets outliers go if the table of bricks would be too large, then grows the cells until it and the list of
// strays are bounded.
void RenderGrid::choose_cells(const Snapshot& snapshot) {
  const Bounds all = bounds_;
  const auto too_large = [this] {
    return static_cast<double>(view_.bricks[0]) * view_.bricks[1] * view_.bricks[2] > kMaxBricks;
  };
  double cell = kCellSpacings * spacing_;
  fit(cell);
  if (too_large()) trim_bounds(snapshot);
  for (;; cell *= 1.25) {
    fit(cell);
    if (too_large()) continue;
    if (count_strays(snapshot) <= kMaxStrays) return;
    bounds_ = all;
  }
}

// Numbers the bricks that a ball touches, in table order.
void RenderGrid::place_bricks(const Snapshot& snapshot) {
  const std::size_t bricks = static_cast<std::size_t>(view_.bricks[0]) * view_.bricks[1] * view_.bricks[2];
  slot_.assign(bricks, kNoBrick);
  parallel_chunks(snapshot.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f p = local(snapshot, i);
      if (!in_cells(p, ball_radius_[i])) continue;
      const CellRange range = cells_of(view_, p, ball_radius_[i] + view_.cell);  // and a cell for SnowSurface
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

// Chebyshev distance to the nearest occupied brick, one axis at a time: D(i) = min over k of max(|k|, D'(i +
// k)).
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
      const Vec3f p = local(snapshot, i);
      std::size_t cell = stray_cell;
      if (in_cells(p, ball_radius_[i])) {
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
        const Vec3f p = local(snapshot, order_[s]);
        for (int a = 0; a < 3; ++a) x_[a][s] = p[a];
        radius_[s] = ball_radius_[order_[s]];
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

// A lone particle is drawn near the ball of its own volume (0.62 spacings); among others it must be larger to
// close the gaps. Between the two by the number of neighbours, each weighted by (1 - d^2/R^2)^2: the count is
// smooth in time.
void RenderGrid::shrink_lone_balls() {
  constexpr float kLoneShare = 0.7f,
                  kCompany = 0.8f;  // evenly packed particles count 2.0, on a flat face 1.4
  const auto reach = static_cast<float>(kCellSpacings * spacing_);
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
        const float company = neighbours(cell, s, reach, kCompany) / kCompany;
        share[s] = company < 1 ? kLoneShare + (1 - kLoneShare) * company * company * (3 - 2 * company) : 1.f;
      }
    }
  });
  for (std::size_t s = 0; s < share.size(); ++s) radius_[s] *= share[s];
}

// The weighted count of balls near ball s of this cell; stops at `enough`.
float RenderGrid::neighbours(const int cell[3], std::uint64_t s, float reach, float enough) const {
  float sum = 0;
  for (int i = 0; i < 27; ++i) {
    const std::size_t near =
        cell_index(view_, cell[0] + i / 9 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i % 3 - 1);
    if (near == kNoCell) continue;
    for (std::uint64_t other = cell_start_[near]; other < cell_start_[near + 1]; ++other) {
      const float dx = x_[0][other] - x_[0][s], dy = x_[1][other] - x_[1][s], dz = x_[2][other] - x_[2][s];
      const float rest = 1 - (dx * dx + dy * dy + dz * dz) / (reach * reach);
      if (rest > 0 && other != s) sum += rest * rest;
    }
    if (sum >= enough) return enough;
  }
  return sum;
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
  measure(snapshot, looks);
  choose_cells(snapshot);
  place_bricks(snapshot);
  measure_clearance();
  sort_balls(snapshot);
  publish();
  find_core();
  shrink_lone_balls();
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
         of(x_[0]) + of(x_[1]) + of(x_[2]) + of(radius_) + of(ball_radius_) + of(core_) + of(bundles_) +
         of(strays_);
}

}  // namespace firn
