// SPDX-License-Identifier: MIT
// In: triangles. Out: a closed, outward mesh and its signed closest points. The closest feature (face, edge
// or vertex) of the closest triangle decides the normal and with it the side.
#include "src/geometry/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "firn/error.h"

namespace firn {
namespace {

// Feature: 0..2 the vertex, 3..5 the edge (k - 3, k - 2), 6 the face.
struct TrianglePoint {
  Vec3 point;
  int feature;
};

// Ericson 2005, "Real-Time Collision Detection", section 5.1.5: the Voronoi regions of a triangle in
// barycentric terms.
TrianglePoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double d1 = ab.dot(p - a), d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return {a, 0};
  const double d3 = ab.dot(p - b), d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return {b, 1};
  const double d5 = ab.dot(p - c), d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return {c, 2};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + ab * (d1 / (d1 - d3)), 3};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return {b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), 4};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + ac * (d2 / (d2 - d6)), 5};
  const double inverse = 1 / (va + vb + vc);
  return {a + ab * (vb * inverse) + ac * (vc * inverse), 6};
}

double squared_distance(const Bounds& box, const Vec3& p) {
  return (box.min - p).cwiseMax(p - box.max).cwiseMax(0.0).squaredNorm();
}

double corner_angle(const Vec3& at, const Vec3& u, const Vec3& v) {
  return std::atan2((u - at).cross(v - at).norm(), (u - at).dot(v - at));
}

using Edge = std::pair<int, int>;

}  // namespace

TriangleMesh::TriangleMesh(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  weld(vertices, triangles);
  if (triangles_.empty()) throw Error(ErrorCode::usage, "", "the mesh has no triangles");
  require_closed();
  for (const Triangle& t : triangles_) {
    volume_ += vertices_[t[0]].dot(vertices_[t[1]].cross(vertices_[t[2]])) / 6;
  }
  if (volume_ < 0) {
    for (Triangle& t : triangles_) std::swap(t[1], t[2]);
    volume_ = -volume_;
  }
  find_normals();
  tree_ = build_mesh_tree(vertices_, triangles_);
}

// Exporters repeat a position for every texture seam; triangles without an area carry no surface and are left
// out.
void TriangleMesh::weld(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  std::map<std::array<double, 3>, int> places;
  std::vector<int> new_index;
  for (const Vec3& v : vertices) {
    const auto [place, fresh] = places.try_emplace({v[0], v[1], v[2]}, static_cast<int>(vertices_.size()));
    if (fresh) vertices_.push_back(v);
    new_index.push_back(place->second);
  }
  for (const Triangle& t : triangles) {
    for (int v : t) {
      if (v < 0 || v >= static_cast<int>(vertices.size())) {
        throw Error(ErrorCode::usage, "",
                    "a face of the mesh names vertex " + std::to_string(v + 1) + " of " +
                        std::to_string(vertices.size()));
      }
    }
    const Triangle welded{new_index[t[0]], new_index[t[1]], new_index[t[2]]};
    if (welded[0] != welded[1] && welded[1] != welded[2] && welded[2] != welded[0])
      triangles_.push_back(welded);
  }
}

// Closed and consistently oriented: every directed edge once, and its reverse once.
void TriangleMesh::require_closed() const {
  std::map<Edge, int> edges;
  for (const Triangle& t : triangles_) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : edges) {
    const auto reverse = edges.find({edge.second, edge.first});
    if (count != 1 || reverse == edges.end() || reverse->second != 1) ++open;
  }
  if (open > 0) {
    throw Error(ErrorCode::usage, "",
                "the mesh is not closed: " + std::to_string(open) + " of its " +
                    std::to_string(edges.size()) +
                    " edges are not shared by exactly two triangles of the same orientation");
  }
}

void TriangleMesh::find_normals() {
  vertex_normal_.assign(vertices_.size(), Vec3::Zero());
  edge_normal_.resize(triangles_.size());
  std::map<Edge, Vec3> edge_sum;
  for (const Triangle& t : triangles_) {
    const Vec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
    const Vec3 normal = (b - a).cross(c - a).normalized();
    face_normal_.push_back(normal);
    for (int k = 0; k < 3; ++k) {
      const int i = t[k], j = t[(k + 1) % 3], l = t[(k + 2) % 3];
      vertex_normal_[i] += normal * corner_angle(vertices_[i], vertices_[j], vertices_[l]);
      edge_sum.try_emplace(std::minmax(i, j), Vec3::Zero()).first->second += normal;
    }
  }
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      edge_normal_[f][k] = edge_sum.at(std::minmax(triangles_[f][k], triangles_[f][(k + 1) % 3]));
    }
  }
}

TriangleMesh::Closest TriangleMesh::closest(const Vec3& p) const {
  double best = 1e300;
  int face = 0;
  TrianglePoint found{Vec3::Zero(), 6};
  std::vector<int> stack{0};
  while (!stack.empty()) {
    const MeshTree::Node& node = tree_.nodes[stack.back()];
    stack.pop_back();
    if (squared_distance(node.bounds, p) >= best) continue;
    if (node.left >= 0) {
      const double left = squared_distance(tree_.nodes[node.left].bounds, p);
      const double right = squared_distance(tree_.nodes[node.left + 1].bounds, p);
      stack.push_back(left < right ? node.left + 1 : node.left);
      stack.push_back(left < right ? node.left : node.left + 1);
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const Triangle& t = triangles_[tree_.order[i]];
      const TrianglePoint point = closest_on_triangle(p, vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]);
      const double squared = (p - point.point).squaredNorm();
      if (squared < best) {
        best = squared;
        face = tree_.order[i];
        found = point;
      }
    }
  }
  const Vec3 normal = found.feature == 6  ? face_normal_[face]
                      : found.feature < 3 ? vertex_normal_[triangles_[face][found.feature]]
                                          : edge_normal_[face][found.feature - 3];
  const double side = (p - found.point).dot(normal) < 0 ? -1 : 1;
  return {found.point, normal.normalized(), side * std::sqrt(best)};
}

}  // namespace firn
