// SPDX-License-Identifier: MIT
// The ball around a point that reaches half-way from its 26th to its 27th neighbour holds 27 points. On a
// cubic lattice these are the cube of three a side, and the ball is 27.2 spacings^3; random points come
// within 3 % of 27, too. Of a point near a surface a part of the ball is empty. How far the points' centroid
// lies from the ball's centre says how much: half of it is empty when that is 3/8 of the radius, and less
// than may be chance means nothing.
#include "src/geometry/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/core/parallel.h"

namespace firn {
namespace {

constexpr std::size_t kInBall = 27;
constexpr std::size_t kMostAsked = 4096;  // points

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double volume_at(const PointTree& tree, const Vec3& p) {
  const std::vector<PointTree::Neighbour> near = tree.nearest(p, kInBall + 1);
  const double radius = 0.5 * (std::sqrt(near[kInBall - 1].distance2) + std::sqrt(near[kInBall].distance2));
  if (!(radius > 0)) return 0;
  Vec3 centroid = Vec3::Zero();
  for (std::size_t k = 0; k < kInBall; ++k)
    centroid += (tree.points()[near[k].index] - p) / (radius * double{kInBall});
  constexpr double kHalf = 9.0 / 64;  // its square where half of the ball is empty
  constexpr double kByChance = 0.06;  // less than that have 19 of 20 balls full of random points
  const double aside = std::max(0.0, centroid.squaredNorm() - kByChance) / (kHalf - kByChance);
  const double filled = std::clamp(1 - 0.5 * std::sqrt(aside), 0.1, 1.0);
  return filled * 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3) / kInBall;
}

}  // namespace

double volume_of_point(const PointTree& tree) {
  const std::size_t count = tree.points().size();
  if (count < 2) return 0;
  const std::size_t asked = std::min(count, kMostAsked);
  std::vector<double> volumes(asked);
  parallel_for(asked, 64, [&](std::size_t i) {
    const Vec3& p = tree.points()[i * count / asked];
    // Too few for a ball: as if they were of a lattice.
    volumes[i] = count > kInBall ? volume_at(tree, p) : std::pow(tree.nearest(p, 2)[1].distance2, 1.5);
  });
  return median(std::move(volumes));
}

}  // namespace firn
