// SPDX-License-Identifier: MIT
// A tree of boxes over triangles, 16 to a node, as kernels/trace/mesh.cpp reads it. Ranges of triangles are
// cut where the areas of the two boxes times what they hold is least, over 16 bins of the triangles' middles
// along each axis (Wald 2007, "On fast construction of SAH-based bounding volume hierarchies"); a node cuts
// its largest child again until it has 16.
#pragma once
#include <vector>

#include "kernels/trace/table.h"
#include "src/geometry/mesh.h"

namespace firn {

struct TriangleTree {
  std::vector<kernels::BoxBundle> nodes;
  std::vector<kernels::TriangleBundle> bundles;
  Bounds bounds;   // m, with the margin
  float size = 0;  // m, as MeshView has it
};

// The same tree wherever it is built.
TriangleTree build_triangle_tree(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);

}  // namespace firn
