// SPDX-License-Identifier: MIT
#include "src/render/solids/triangles.h"

#include <Eigen/Geometry>
#include <utility>

#include "src/geometry/height_field.h"

namespace firn {
namespace {

void add_quad(std::vector<Triangle>& triangles, int a, int b, int c, int d) {
  triangles.push_back({a, b, c});
  triangles.push_back({a, c, d});
}

}  // namespace

TriangleSet::TriangleSet(std::vector<Vec3> vertices, std::vector<Triangle> triangles)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      tree_(build_triangle_tree(vertices_, triangles_)) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Triangle) == 3 * sizeof(std::int32_t));
  if (triangles_.empty()) return;
  view_.nodes = tree_.nodes.data();
  view_.triangles = tree_.bundles.data();
  view_.vertices = vertices_.front().data();
  view_.corners = triangles_.front().data();
  for (int a = 0; a < 3; ++a) view_.low[a] = tree_.bounds.min[a], view_.high[a] = tree_.bounds.max[a];
  view_.size = tree_.size;
}

Vec3 TriangleSet::normal(int triangle) const {
  const Triangle& corner = triangles_[triangle];
  const Vec3& a = vertices_[corner[0]];
  return (vertices_[corner[1]] - a).cross(vertices_[corner[2]] - a).normalized();
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
