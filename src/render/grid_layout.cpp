// SPDX-License-Identifier: MIT
#include "src/render/grid_layout.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kernels/trace/table.h"
#include "src/core/error.h"
#include "src/core/parallel.h"
#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr double kCellSpacings = 1.5;     // cell edge in mean particle spacings
constexpr double kMaxRadiusCells = 2;     // larger balls are strays
constexpr std::size_t kMaxStrays = 1024;  // every ray tests them all
constexpr double kMaxBricks = 1 << 22;
constexpr double kFarthest = 1e12;  // m; beyond it cells cannot be counted
constexpr std::size_t kChunk = 8192;

struct Statistics {
  Bounds bounds;
  double spacing_sum = 0;
  std::size_t bad = SIZE_MAX;  // index of a particle that cannot be drawn

  void include(const Statistics& other) {
    bounds.include(other.bounds);
    spacing_sum += other.spacing_sum;
    bad = std::min(bad, other.bad);
  }
};

// Bounds and spacings of particles [begin, end); sets their radii.
Statistics measure(const Snapshot& snapshot, const std::vector<SnowLook>& looks, std::size_t begin,
                   std::size_t end, std::vector<float>& radius) {
  Statistics part;
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3 p = snapshot.world_position(i);
    if (!p.allFinite() || !std::isfinite(snapshot.volume0[i]) || p.cwiseAbs().maxCoeff() > kFarthest) {
      part.bad = std::min(part.bad, i);
      continue;
    }
    const double spacing = portable_cbrt(snapshot.volume0[i]);
    const SnowLook look =
        looks.empty() ? SnowLook{} : looks[std::min<std::size_t>(snapshot.object[i], looks.size() - 1)];
    radius[i] = static_cast<float>(spacing * look.radius);
    part.bounds.include(p);
    part.spacing_sum += spacing;
  }
  return part;
}

// Lays cells over the bounds; false if their table of bricks is too large.
bool fit(GridLayout& layout, const Bounds& bounds, double cell) {
  layout.cell = cell;
  if (bounds.empty()) return true;
  const double margin = kMaxRadiusCells * cell;
  layout.origin = bounds.min - Vec3::Constant(margin);
  double table = 1;
  for (int a = 0; a < 3; ++a) {
    const double bricks = std::ceil((bounds.size()[a] + 2 * margin) / (kernels::kBrickCells * cell));
    layout.bricks[a] = static_cast<int>(std::min(bricks, 1e6));
    table *= bricks;
  }
  return table <= kMaxBricks;
}

// The bounds of all but a few outlying particles: cut where 1 % (at most 128) lie beyond on each side of each
// axis, then widened by their own size.
Bounds trim(const Snapshot& snapshot, const Bounds& all, double spacing) {
  const std::size_t count = snapshot.size(), beyond = std::min<std::size_t>(count / 100, 128);
  Bounds kept = all;
  for (int a = 0; a < 3; ++a) {
    std::vector<float> column = snapshot.x[a];
    const auto low = column.begin() + static_cast<std::ptrdiff_t>(beyond);
    const auto high = column.begin() + static_cast<std::ptrdiff_t>(count - 1 - beyond);
    std::nth_element(column.begin(), low, column.end());
    const double from = *low;
    std::nth_element(column.begin(), high, column.end());
    const double to = *high, size = to - from + 16 * spacing;
    kept.min[a] = std::max(all.min[a], snapshot.origin[a] + from - size);
    kept.max[a] = std::min(all.max[a], snapshot.origin[a] + to + size);
  }
  return kept;
}

std::size_t count_strays(const Snapshot& snapshot, const GridLayout& layout) {
  std::vector<std::size_t> parts((snapshot.size() + kChunk - 1) / kChunk, 0);
  parallel_chunks(snapshot.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      parts[chunk] += !layout.holds(layout.local(snapshot, i), layout.radius[i]);
    }
  });
  std::size_t sum = 0;
  for (const std::size_t part : parts) sum += part;
  return sum;
}

}  // namespace

bool GridLayout::holds(const Vec3f& local, float ball_radius) const {
  if (ball_radius > kMaxRadiusCells * cell) return false;
  for (int a = 0; a < 3; ++a) {
    if (!(local[a] >= 0 && local[a] < kernels::kBrickCells * bricks[a] * cell)) return false;
  }
  return true;
}

GridLayout lay_out_grid(const Snapshot& snapshot, const std::vector<SnowLook>& looks) {
  const std::size_t count = snapshot.size();
  GridLayout layout;
  layout.origin = snapshot.origin;
  layout.radius.resize(count);
  std::vector<Statistics> parts((count + kChunk - 1) / kChunk);
  parallel_chunks(count, kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    parts[chunk] = measure(snapshot, looks, begin, end, layout.radius);
  });
  Statistics all;
  for (const Statistics& part : parts) all.include(part);
  if (all.bad != SIZE_MAX) {
    throw Error(
        ExitCode::unstable, "frame " + std::to_string(snapshot.frame),
        "particle " + std::to_string(snapshot.id[all.bad]) + " has no finite place or volume to draw");
  }
  if (count > 0) layout.spacing = std::max(all.spacing_sum / static_cast<double>(count), 1e-9);
  Bounds bounds = all.bounds;
  double cell = kCellSpacings * layout.spacing;
  if (!fit(layout, bounds, cell)) bounds = trim(snapshot, bounds, layout.spacing);
  for (;; cell *= 1.25) {
    if (!fit(layout, bounds, cell)) continue;
    if (count_strays(snapshot, layout) <= kMaxStrays) return layout;
    bounds = all.bounds;
  }
}

}  // namespace firn
