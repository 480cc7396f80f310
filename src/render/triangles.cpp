// SPDX-License-Identifier: MIT
#include "src/render/triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "src/geometry/height_field.h"

namespace firn {
namespace {

// Distance to a box, or `limit` if it is missed.
double enter_box(const Bounds& box, const Vec3& o, const Vec3& inv, double limit) {
  double t_in = 0, t_out = limit;
  for (int a = 0; a < 3; ++a) {
    const double t0 = (box.min[a] - o[a]) * inv[a], t1 = (box.max[a] - o[a]) * inv[a];
    t_in = std::max(t_in, std::min(t0, t1));  // a NaN (0 * inf) leaves the bound as it is
    t_out = std::min(t_out, std::max(t0, t1));
  }
  return t_in <= t_out ? t_in : limit;
}

// Moeller & Trumbore 1997.
double hit_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& o, const Vec3& d, double limit) {
  const Vec3 u = b - a, v = c - a, p = d.cross(v);
  const double det = u.dot(p);
  if (det == 0) return limit;
  const Vec3 s = o - a;
  const double bu = s.dot(p) / det;
  if (!(bu >= 0 && bu <= 1)) return limit;
  const Vec3 q = s.cross(u);
  const double bv = d.dot(q) / det;
  if (!(bv >= 0 && bu + bv <= 1)) return limit;
  const double t = v.dot(q) / det;
  return t > 0 && t < limit ? t : limit;
}

void add_quad(std::vector<Triangle>& triangles, int a, int b, int c, int d) {
  triangles.push_back({a, b, c});
  triangles.push_back({a, c, d});
}

}  // namespace

TriangleSet::TriangleSet(std::vector<Vec3> vertices, std::vector<Triangle> triangles)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      tree_(build_mesh_tree(vertices_, triangles_)) {}

double TriangleSet::intersect(const Vec3& o, const Vec3& d, double limit, Vec3& normal) const {
  const Vec3 inv = d.cwiseInverse();
  int stack[64], top = 0, best = -1;
  stack[top++] = 0;
  while (top > 0) {
    const MeshTree::Node& node = tree_.nodes[stack[--top]];
    if (!(enter_box(node.bounds, o, inv, limit) < limit)) continue;
    if (node.left >= 0) {
      const bool left_first = enter_box(tree_.nodes[node.left].bounds, o, inv, limit) <=
                              enter_box(tree_.nodes[node.left + 1].bounds, o, inv, limit);
      stack[top++] = node.left + (left_first ? 1 : 0);
      stack[top++] = node.left + (left_first ? 0 : 1);
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const Triangle& corner = triangles_[tree_.order[i]];
      const double t =
          hit_triangle(vertices_[corner[0]], vertices_[corner[1]], vertices_[corner[2]], o, d, limit);
      if (t < limit) limit = t, best = tree_.order[i];
    }
  }
  if (best >= 0) {
    const Triangle& corner = triangles_[best];
    const Vec3& a = vertices_[corner[0]];
    normal = (vertices_[corner[1]] - a).cross(vertices_[corner[2]] - a).normalized();
  }
  return limit;
}

std::shared_ptr<const TriangleSet> triangles_of(const Mesh& mesh) {
  return std::make_shared<TriangleSet>(mesh.mesh->vertices(), mesh.mesh->triangles());
}

std::shared_ptr<const TriangleSet> triangles_of(const HeightField& field) {
  const HeightRaster& raster = *field.raster;
  const int columns = raster.columns(), rows = raster.rows(), count = columns * rows;
  std::vector<Vec3> vertices(2 * static_cast<std::size_t>(count));
  std::vector<Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    const int column = i % columns, row = i / columns;
    const double x = raster.width() * (static_cast<double>(column) / (columns - 1) - 0.5);
    const double z = raster.depth() * (static_cast<double>(row) / (rows - 1) - 0.5);
    vertices[i] = Vec3(x, raster.node(column, row), z);
    vertices[count + i] = Vec3(x, field.base, z);
    if (column + 1 == columns || row + 1 == rows) continue;
    add_quad(triangles, i, i + columns, i + columns + 1, i + 1);
    add_quad(triangles, count + i, count + i + 1, count + i + columns + 1, count + i + columns);
  }
  for (int c = 0; c + 1 < columns; ++c) {
    const int last = (rows - 1) * columns + c;
    add_quad(triangles, c, c + 1, count + c + 1, count + c);
    add_quad(triangles, last + 1, last, count + last, count + last + 1);
  }
  for (int r = 0; r + 1 < rows; ++r) {
    const int first = r * columns, last = first + columns - 1;
    add_quad(triangles, first + columns, first, count + first, count + first + columns);
    add_quad(triangles, last, last + columns, count + last + columns, count + last);
  }
  return std::make_shared<TriangleSet>(std::move(vertices), std::move(triangles));
}

}  // namespace firn
