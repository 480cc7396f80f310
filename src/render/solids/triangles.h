// SPDX-License-Identifier: MIT
// Triangles that rays can hit: a mesh as it is, or a height field cut into triangles, with its walls and
// floor.
#pragma once
#include <memory>
#include <vector>

#include "kernels/trace/table.h"
#include "src/geometry/mesh.h"
#include "src/geometry/shape.h"
#include "src/render/solids/triangle_tree.h"

namespace firn {

class TriangleSet {
 public:
  TriangleSet(std::vector<Vec3> vertices, std::vector<Triangle> triangles);
  TriangleSet(const TriangleSet&) = delete;
  TriangleSet& operator=(const TriangleSet&) = delete;

  // For TraceKernels::mesh_closest; lives as long as this.
  const kernels::MeshView& view() const { return view_; }
  // Unit, on the side from which a triangle's corners go counter-clockwise.
  Vec3 normal(int triangle) const;

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }

 private:
  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  TriangleTree tree_;
  kernels::MeshView view_;
};

std::shared_ptr<const TriangleSet> triangles_of(const Mesh& mesh);
std::shared_ptr<const TriangleSet> triangles_of(const HeightField& field);

}  // namespace firn
