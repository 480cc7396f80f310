// SPDX-License-Identifier: MIT
#include "src/render/snow/grid_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "firn/error.h"
#include "kernels/trace/table.h"
#include "src/core/parallel.h"
#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr double kCellSpacings = 1.6;     // cell edge in mean particle spacings
constexpr double kMaxRadiusCells = 2;     // larger balls are strays
constexpr std::size_t kMaxStrays = 1024;  // every ray tests them all
constexpr double kMaxBricks = 1 << 22;
constexpr float kFarthest = 1e12f;  // m, from the snapshot's origin; beyond it cells cannot be counted

struct Statistics {
  Bounds bounds;
  double spacing_sum = 0;
  float max_radius = 0;        // m
  bool alike = true;           // of one volume and one object
  std::size_t bad = SIZE_MAX;  // index of a particle that cannot be drawn
};

// The first of [begin, end) that has no finite place or volume.
std::size_t find_bad(const Snapshot& snapshot, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    float sum = std::fabs(snapshot.volume0[i]);
    for (std::size_t a = 0; a < 3; ++a) sum += std::fabs(snapshot.position[a][i]);
    if (!(sum <= kFarthest)) return i;
  }
  return SIZE_MAX;
}

// Of particles [begin, end).
Statistics measure(const kernels::TraceKernels& kernels, const Snapshot& snapshot, BallSizes sizes,
                   std::size_t begin, std::size_t end) {
  Statistics part;
  Vec3 low, high;
  const kernels::Extent volume = kernels.extent(snapshot.volume0.data(), begin, end);
  bool sound = volume.finite;
  for (int a = 0; a < 3; ++a) {
    const kernels::Extent along = kernels.extent(snapshot.position[a].data(), begin, end);
    low[a] = along.low;
    high[a] = along.high;
    sound = sound && along.finite && std::max(-along.low, along.high) <= kFarthest;
  }
  if (!sound) part.bad = find_bad(snapshot, begin, end);
  if (part.bad != SIZE_MAX) return part;
  part.bounds.include(vec(snapshot.origin) + low);
  part.bounds.include(vec(snapshot.origin) + high);
  std::uint16_t others = 0;
  for (std::size_t i = begin; i < end; ++i)
    others = static_cast<std::uint16_t>(others | (snapshot.object[i] ^ snapshot.object[begin]));
  part.alike = volume.low == volume.high && others == 0;
  part.max_radius = sizes.radius(snapshot, begin);
  part.spacing_sum = sizes.spacing() * static_cast<double>(end - begin);
  if (part.alike) return part;
  part.spacing_sum = 0;
  for (std::size_t i = begin; i < end; ++i) {
    part.max_radius = std::max(part.max_radius, sizes.radius(snapshot, i));
    part.spacing_sum += sizes.spacing();
  }
  return part;
}

// Lays cells over the bounds; false if their table of bricks is too large.
bool fit(GridLayout& layout, const Snapshot& snapshot, const Bounds& bounds, double cell) {
  layout.cell = cell;
  if (bounds.empty()) return true;
  const double margin = kMaxRadiusCells * cell;
  double table = 1;
  for (int a = 0; a < 3; ++a) {
    // The cells lie where multiples of their size do in the world, so that snow at rest keeps its place among
    // them from frame to frame. The shift in float, as the particles are moved by it; then the origin that
    // belongs to it.
    const double corner = std::floor((bounds.min[a] - margin) / cell) * cell;
    layout.shift[a] = static_cast<float>(snapshot.origin[a] - corner);
    layout.origin[a] = snapshot.origin[a] - static_cast<double>(layout.shift[a]);
    const double bricks = std::ceil((bounds.max[a] + margin - corner) / (kernels::kBrickCells * cell));
    layout.bricks[a] = static_cast<int>(std::min(bricks, 1e6));
    layout.size[a] = static_cast<float>(kernels::kBrickCells * layout.bricks[a]) * static_cast<float>(cell);
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
    const auto along = snapshot.position[a];
    std::vector<float> column(along.begin(), along.end());
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
  std::vector<std::size_t> parts((snapshot.size() + kParticleChunk - 1) / kParticleChunk, 0);
  parallel_chunks(snapshot.size(), kParticleChunk,
                  [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                    BallSizes sizes = layout.sizes;
                    for (std::size_t i = begin; i < end; ++i) {
                      parts[chunk] += !layout.holds(layout.local(snapshot, i), sizes.radius(snapshot, i));
                    }
                  });
  std::size_t sum = 0;
  for (const std::size_t part : parts) sum += part;
  return sum;
}

}  // namespace

void BallSizes::remember(const Snapshot& snapshot, std::size_t i) {
  volume_ = snapshot.volume0[i];
  object_ = snapshot.object[i];
  spacing_ = portable_cbrt(volume_);
  const SnowLook look =
      looks_->empty() ? SnowLook{} : (*looks_)[std::min<std::size_t>(object_, looks_->size() - 1)];
  radius_ = static_cast<float>(spacing_ * look.radius);
}

float GridLayout::largest_radius() const { return static_cast<float>(kMaxRadiusCells * cell); }

bool GridLayout::holds(const Vec3f& local, float ball_radius) const {
  if (!(ball_radius <= largest_radius())) return false;
  for (int a = 0; a < 3; ++a) {
    if (!(local[a] >= 0 && local[a] < size[a])) return false;
  }
  return true;
}

GridLayout lay_out_grid(const kernels::TraceKernels& kernels, const Snapshot& snapshot,
                        const std::vector<SnowLook>& looks) {
  const std::size_t count = snapshot.size();
  GridLayout layout;
  layout.sizes = BallSizes(looks);
  layout.origin = vec(snapshot.origin);
  std::vector<Statistics> parts((count + kParticleChunk - 1) / kParticleChunk);
  parallel_chunks(count, kParticleChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    parts[chunk] = measure(kernels, snapshot, layout.sizes, begin, end);
  });
  Statistics all;
  for (std::size_t chunk = 0; chunk < parts.size(); ++chunk) {
    const Statistics& part = parts[chunk];
    all.bounds.include(part.bounds);
    all.spacing_sum += part.spacing_sum;
    all.max_radius = std::max(all.max_radius, part.max_radius);
    all.bad = std::min(all.bad, part.bad);
    all.alike = all.alike && part.alike && snapshot.volume0[chunk * kParticleChunk] == snapshot.volume0[0] &&
                snapshot.object[chunk * kParticleChunk] == snapshot.object[0];
  }
  if (all.bad != SIZE_MAX) {
    throw Error(
        ErrorCode::unstable, "frame " + std::to_string(snapshot.frame),
        "particle " + std::to_string(snapshot.id[all.bad]) + " has no finite place or volume to draw");
  }
  if (count > 0 && all.alike) {
    layout.sizes.radius(snapshot, 0);
    layout.sizes.settle();
  }
  if (count > 0) layout.spacing = std::max(all.spacing_sum / static_cast<double>(count), 1e-9);
  Bounds bounds = all.bounds;
  double cell = kCellSpacings * layout.spacing;
  if (!fit(layout, snapshot, bounds, cell)) bounds = trim(snapshot, bounds, layout.spacing);
  for (;; cell *= 1.25) {
    if (!fit(layout, snapshot, bounds, cell)) continue;
    layout.radii_fit = all.max_radius <= layout.largest_radius();
    const bool holds_all = layout.radii_fit && bounds.min == all.bounds.min && bounds.max == all.bounds.max;
    if (holds_all || count_strays(snapshot, layout) <= kMaxStrays) return layout;
    bounds = all.bounds;
  }
}

}  // namespace firn
