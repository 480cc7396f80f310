// SPDX-License-Identifier: MIT
// Builds the mesh's bounding-volume tree: median cuts along the longest axis, at most four triangles a leaf.
// Ties are broken by index, so the tree is the same wherever it is built.
#include <algorithm>

#include "src/geometry/mesh.h"

namespace firn {
namespace {

constexpr int kLeafTriangles = 4;

Bounds triangle_bounds(const std::vector<Vec3>& vertices, const Triangle& t) {
  Bounds bounds;
  for (int v : t) bounds.include(vertices[v]);
  return bounds;
}

struct Builder {
  MeshTree& tree;
  std::vector<Bounds> bounds;  // of each triangle

  void split(int node_index) {
    const int begin = tree.nodes[node_index].begin;
    const int end = tree.nodes[node_index].end;
    Bounds all, centers;
    for (int i = begin; i < end; ++i) {
      all.include(bounds[tree.order[i]]);
      centers.include(bounds[tree.order[i]].center());
    }
    tree.nodes[node_index].bounds = all;
    if (end - begin <= kLeafTriangles) return;
    int axis = 0;
    centers.size().maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    std::nth_element(tree.order.begin() + begin, tree.order.begin() + middle, tree.order.begin() + end,
                     [&](int a, int b) {
                       const double ca = bounds[a].center()[axis], cb = bounds[b].center()[axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    const int left = static_cast<int>(tree.nodes.size());
    tree.nodes[node_index].left = left;
    tree.nodes.push_back({{}, -1, begin, middle});
    tree.nodes.push_back({{}, -1, middle, end});
    split(left);
    split(left + 1);
  }
};

}  // namespace

MeshTree build_mesh_tree(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  MeshTree tree;
  Builder builder{tree, {}};
  const int count = static_cast<int>(triangles.size());
  for (int i = 0; i < count; ++i) {
    tree.order.push_back(i);
    builder.bounds.push_back(triangle_bounds(vertices, triangles[i]));
  }
  tree.nodes.push_back({{}, -1, 0, count});
  builder.split(0);
  return tree;
}

}  // namespace firn
