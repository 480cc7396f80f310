// SPDX-License-Identifier: MIT
#include "src/geometry/point_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace firn {
namespace {

constexpr std::size_t kLeaf = 8;  // points that are looked at one by one

std::size_t middle_of(std::size_t begin, std::size_t end) { return begin + (end - begin) / 2; }

}  // namespace

// The best neighbours yet, the farthest of them on top.
struct PointTree::Search {
  Vec3 p;
  std::size_t count;
  std::vector<Neighbour> found = {};

  double limit2() const { return found.size() < count ? HUGE_VAL : found.front().distance2; }
  void meet(const Vec3& point, std::size_t index) {
    const double distance2 = (point - p).squaredNorm();
    if (!(distance2 < limit2())) return;
    if (found.size() == count) {
      std::pop_heap(found.begin(), found.end());
      found.pop_back();
    }
    found.push_back({distance2, index});
    std::push_heap(found.begin(), found.end());
  }
};

PointTree::PointTree(std::vector<Vec3> points) : points_(std::move(points)), axis_(points_.size()) {
  build(0, points_.size());
}

void PointTree::build(std::size_t begin, std::size_t end) {
  if (end - begin <= kLeaf) return;
  Bounds bounds;
  for (std::size_t i = begin; i < end; ++i) bounds.include(points_[i]);
  Eigen::Index axis = 0;
  bounds.size().maxCoeff(&axis);
  const std::size_t middle = middle_of(begin, end);
  const auto at = [this](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end),
                   [axis](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; });
  axis_[middle] = static_cast<std::uint8_t>(axis);
  build(begin, middle);
  build(middle + 1, end);
}

void PointTree::look(Search& search, std::size_t begin, std::size_t end) const {
  if (end - begin <= kLeaf) {
    for (std::size_t i = begin; i < end; ++i) search.meet(points_[i], i);
    return;
  }
  const std::size_t middle = middle_of(begin, end);
  const double beyond = search.p[axis_[middle]] - points_[middle][axis_[middle]];
  const auto side = [&](bool upper) {
    return upper ? look(search, middle + 1, end) : look(search, begin, middle);
  };
  side(beyond > 0);
  search.meet(points_[middle], middle);
  if (beyond * beyond < search.limit2()) side(!(beyond > 0));
}

std::vector<PointTree::Neighbour> PointTree::nearest(const Vec3& p, std::size_t count) const {
  Search search{p, count};
  if (count > 0) look(search, 0, points_.size());
  std::sort_heap(search.found.begin(), search.found.end());
  return std::move(search.found);
}

double PointTree::distance(const Vec3& p) const {
  Search search{p, 1};
  look(search, 0, points_.size());
  return std::sqrt(search.limit2());
}

}  // namespace firn
