// SPDX-License-Identifier: MIT
// What of the snow's mass is in its medium: the density, summed over cells, and what of it the surface or the
// balls enclose, for which a cell is 4x4x4 points, a bit each of a word.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "src/core/parallel.h"
#include "src/render/snow/snow_field.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kBrickCorners;
using kernels::kCellsPerBrick;

constexpr int kPoints = 4;  // along each side of a cell

// Of each cell of an occupied brick the points that lie in a ball.
std::vector<std::uint64_t> points_in_balls(const RenderGrid& grid) {
  const kernels::TraceGrid& view = grid.view();
  const std::size_t cells = grid.brick_of_slot().size() * kCellsPerBrick;
  std::vector<std::uint64_t> in(cells, 0);
  const float apart = view.cell / kPoints;
  parallel_for(view.cell_start[cells], 4096, [&](std::size_t s) {
    const auto ball = static_cast<std::uint32_t>(s);
    const float r = grid.radius(ball);
    if (!(r > 0)) return;
    const Vec3f c = grid.center(ball) / apart - Vec3f::Constant(0.5f);  // of a point as its number
    const float reach = r / apart;
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = std::max(static_cast<int>(std::ceil(c[a] - reach)), 0);
      high[a] = std::min(static_cast<int>(std::floor(c[a] + reach)), kPoints * view.cells[a] - 1);
    }
    for (int x = low[0]; x <= high[0]; ++x) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int z = low[2]; z <= high[2]; ++z) {
          const Vec3f from(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
          if ((from - c).squaredNorm() > reach * reach) continue;
          const std::size_t cell = cell_index(view, x / kPoints, y / kPoints, z / kPoints);
          if (cell == kNoCell) continue;
          const int point = (x % kPoints * kPoints + y % kPoints) * kPoints + z % kPoints;
          std::atomic_ref<std::uint64_t>(in[cell]).fetch_or(std::uint64_t{1} << point,
                                                            std::memory_order_relaxed);
        }
      }
    }
  });
  return in;
}

// The sum of each brick's share, always in the same order.
template <class Brick>
double sum_over_bricks(std::size_t count, Brick&& brick) {
  std::vector<double> sums(count);
  parallel_for(count, 16, [&](std::size_t slot) { sums[slot] = brick(slot); });
  double sum = 0;
  for (const double each : sums) sum += each;
  return sum;
}

}  // namespace

// Of a trilinear field each cell holds its volume times the mean of its corners.
double SnowField::mean_density(std::size_t cell) const {
  const int c = static_cast<int>(cell % kCellsPerBrick);
  const float* corner =
      &density_[cell / kCellsPerBrick * kBrickCorners + corner_index(c >> 4, c >> 2 & 3, c & 3)];
  double sum = 0;
  for (int k = 0; k < 8; ++k) sum += corner[corner_index(k >> 2, k >> 1 & 1, k & 1)];
  return sum / 8;
}

double SnowField::mass() const {
  const double sum = sum_over_bricks(grid_->brick_of_slot().size(), [&](std::size_t slot) {
    double its = 0;
    for (std::size_t c = 0; c < kCellsPerBrick; ++c) its += mean_density(slot * kCellsPerBrick + c);
    return its;
  });
  return sum * std::pow(static_cast<double>(grid_->view().cell), 3);
}

double SnowField::medium_mass() const {
  const std::vector<std::uint64_t> in_balls = points_in_balls(*grid_);
  const double sum = sum_over_bricks(grid_->brick_of_slot().size(), [&](std::size_t slot) {
    double its = 0;
    for (int c = 0; c < kCellsPerBrick; ++c) {
      const std::size_t cell = slot * kCellsPerBrick + static_cast<std::size_t>(c);
      const std::uint32_t kind = kind_[cell >> 3] >> (4 * (cell & 7)) & 3;
      if (kind == kernels::kInside && in_balls[cell] == 0) {
        its += mean_density(cell);
      } else if (kind != kernels::kOutside || in_balls[cell] != 0) {
        its += enclosed_density({slot, {c >> 4, c >> 2 & 3, c & 3}, {}}, in_balls[cell]);
      }
    }
    return its;
  });
  return sum * std::pow(static_cast<double>(grid_->view().cell), 3);
}

// The mean over the points of a cell of what the medium has there, as MediumField says.
double SnowField::enclosed_density(Place place, std::uint64_t in_balls) const {
  double sum = 0;
  for (int k = 0; k < kPoints * kPoints * kPoints; ++k) {
    const int at[3] = {k / (kPoints * kPoints), k / kPoints % kPoints, k % kPoints};
    for (int a = 0; a < 3; ++a) place.part[a] = (static_cast<float>(at[a]) + 0.5f) / kPoints;
    const bool in_ball = (in_balls >> k & 1) != 0, of_balls = fill_.empty();
    float here = 0;
    if (of_balls ? in_ball : interpolate(fill_, place) >= surface_.level) here = interpolate(density_, place);
    sum += in_ball && !of_balls ? std::max(here, loose_density_) : here;
  }
  return sum / (kPoints * kPoints * kPoints);
}

}  // namespace firn
