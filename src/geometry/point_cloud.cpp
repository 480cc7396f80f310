// SPDX-License-Identifier: MIT
// The ball around a point that reaches half-way from its 26th to its 27th neighbour holds 27 points. On a
// cubic lattice these are the cube of three a side, and the ball is 27.2 spacings^3; of random points it has
// room for 26.5, and for 28.1 of a lattice whose points were moved by up to a quarter of the spacing: kRoom
// is amid them. Of a point near a surface a part of the ball is empty, as the points' centroid shows, which
// lies off the ball's centre: such points are asked only where there are hardly any others.
#include "src/geometry/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/core/parallel.h"

namespace firn {
namespace {

constexpr std::size_t kInBall = 27;
constexpr double kRoom = 27.4;
constexpr std::size_t kMostAsked = 4096;  // points

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Ball27 {
  double volume;  // a point
  double aside2;  // square of the centroid's distance from the centre, in radii
};

Ball27 ball_about(const PointTree& tree, const Vec3& p) {
  const std::vector<PointTree::Neighbour> near = tree.nearest(p, kInBall + 1);
  const double radius = 0.5 * (std::sqrt(near[kInBall - 1].distance2) + std::sqrt(near[kInBall].distance2));
  if (!(radius > 0)) return {0, 0};
  Vec3 centroid = Vec3::Zero();
  for (std::size_t k = 0; k < kInBall; ++k)
    centroid += (tree.points()[near[k].index] - p) / (radius * double{kInBall});
  return {4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3) / kRoom, centroid.squaredNorm()};
}

// Random points have a centroid by chance 0.6 / 27 off, in the mean of its square. Of a ball that is half
// empty it is 3/8 of the radius off.
double median_volume(const std::vector<Ball27>& balls) {
  constexpr double kByChance = 0.6 / kInBall;
  std::vector<double> inside, all;
  for (const Ball27& ball : balls) {
    const double aside = std::sqrt(std::max(0.0, ball.aside2 - kByChance));
    all.push_back(ball.volume * std::clamp(1 - 4.0 / 3.0 * aside, 0.1, 1.0));
    if (ball.aside2 < 1.4 * kByChance) inside.push_back(ball.volume);
  }
  const bool enough = inside.size() >= 8 && 20 * inside.size() >= all.size();
  return median(std::move(enough ? inside : all));
}

}  // namespace

double volume_of_point(const PointTree& tree) {
  const std::size_t count = tree.points().size();
  if (count < 2) return 0;
  const std::size_t asked = std::min(count, kMostAsked);
  const auto point = [&](std::size_t i) -> const Vec3& { return tree.points()[i * count / asked]; };
  if (count <= kInBall) {  // as if they were of a lattice
    std::vector<double> cubes;
    for (const Vec3& p : tree.points()) cubes.push_back(std::pow(tree.nearest(p, 2)[1].distance2, 1.5));
    return median(std::move(cubes));
  }
  std::vector<Ball27> balls(asked);
  parallel_for(asked, 64, [&](std::size_t i) { balls[i] = ball_about(tree, point(i)); });
  return median_volume(balls);
}

}  // namespace firn
