// SPDX-License-Identifier: MIT
// A k-d tree over points, for their nearest neighbours: balanced and without a pointer, since each part of
// the array is parted at its middle. Points may coincide or lie apart by any distance.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/core/vector.h"

namespace firn {

class PointTree {
 public:
  explicit PointTree(std::vector<Vec3> points);

  struct Neighbour {
    double distance2;  // m^2
    std::size_t index;
    bool operator<(const Neighbour& other) const { return distance2 < other.distance2; }
  };
  // The `count` nearest to p, or all if there are fewer, nearest first.
  std::vector<Neighbour> nearest(const Vec3& p, std::size_t count) const;
  double distance(const Vec3& p) const;  // m, to the nearest; infinite where there is none

  const std::vector<Vec3>& points() const { return points_; }  // in the tree's order

 private:
  struct Search;
  void build(std::size_t begin, std::size_t end);
  void look(Search& search, std::size_t begin, std::size_t end) const;

  std::vector<Vec3> points_;
  std::vector<std::uint8_t> axis_;  // along which the part is cut whose middle this point is
};

}  // namespace firn
