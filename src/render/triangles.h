// SPDX-License-Identifier: MIT
// Triangles that rays can hit: a mesh as it is, or a height field cut into triangles, with its walls and
// floor.
#pragma once
#include <memory>
#include <vector>

#include "src/geometry/mesh.h"
#include "src/geometry/shape.h"

namespace firn {

class TriangleSet {
 public:
  TriangleSet(std::vector<Vec3> vertices, std::vector<Triangle> triangles);

  // The nearest triangle that o + t d meets at 0 < t < limit, from either side; t, or `limit` if none.
  // `normal` (unit, the side of counter-clockwise order) is set on a hit.
  double intersect(const Vec3& o, const Vec3& d, double limit, Vec3& normal) const;

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  MeshTree tree_;
};

std::shared_ptr<const TriangleSet> triangles_of(const Mesh& mesh);
std::shared_ptr<const TriangleSet> triangles_of(const HeightField& field);

}  // namespace firn
