// SPDX-License-Identifier: MIT
// A closed triangle mesh that knows its inside. In: vertices and triangles (of an OBJ file or a program).
// Out: closest points with the sign of the side, found through a small bounding-volume tree. The sign comes
// from angle-weighted pseudonormals (Baerentzen, Aanaes 2005, "Signed distance computation using the angle
// weighted pseudonormal"): exact for closed, consistently oriented meshes and as cheap as the closest point
// itself, where a winding number costs a pass over all triangles.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "src/core/vector.h"

namespace firn {

using Triangle = std::array<int, 3>;  // vertex indices, counter-clockwise seen from outside

// The tree over the triangles: node i has children left and left + 1, or (left < 0) holds order[begin, end).
struct MeshTree {
  struct Node {
    Bounds bounds;
    int left = -1;
    int begin = 0, end = 0;
  };
  std::vector<Node> nodes;
  std::vector<int> order;  // triangle indices
};
MeshTree build_mesh_tree(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);

class TriangleMesh {
 public:
  struct Closest {
    Vec3 point;   // m, on the surface
    Vec3 normal;  // outward unit normal there: of the face, or the pseudonormal of the edge or vertex
    double signed_distance;  // m, negative inside
  };

  // Vertices at exactly the same place become one; a mesh that is inside out is turned. Errors: usage Error
  // without a place when there are no triangles, an index is out of range, or the surface is not closed.
  TriangleMesh(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  const Bounds& bounds() const { return tree_.nodes.front().bounds; }
  double volume() const { return volume_; }  // m^3
  Closest closest(const Vec3& p) const;

 private:
  void weld(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles);
  void require_closed() const;
  void find_normals();

  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<Vec3> face_normal_;                 // unit
  std::vector<Vec3> vertex_normal_;               // angle-weighted, any length
  std::vector<std::array<Vec3, 3>> edge_normal_;  // of edge (k, k + 1) of each triangle, any length
  MeshTree tree_;
  double volume_ = 0;
};

// Reads a Wavefront OBJ file; polygons become triangles, all its groups one mesh. `scale` multiplies every
// coordinate. Errors: io Error when it cannot be read or holds no faces, usage Error when its surface is not
// closed.
TriangleMesh load_obj(const std::string& path, double scale);

}  // namespace firn
