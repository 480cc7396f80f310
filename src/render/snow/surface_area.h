// SPDX-License-Identifier: MIT
// Points spread evenly over the surface of a shape, in its own frame: where a glowing object sends light
// from.
#pragma once
#include <memory>
#include <vector>

#include "src/geometry/shape.h"
#include "src/render/sampling/sampler.h"
#include "src/render/solids/triangles.h"

namespace firn {

class SurfaceArea {
 public:
  struct Point {
    Vec3 p;       // m
    Vec3 normal;  // unit, outward
  };

  // `triangles` of a mesh or height field, else null.
  SurfaceArea(const Shape& shape, std::shared_ptr<const TriangleSet> triangles);

  double area() const { return area_; }  // m^2; 0 for a plane, which has no end
  Point point(Sample2 at) const;

 private:
  Shape shape_;
  std::shared_ptr<const TriangleSet> triangles_;
  std::vector<double> until_;  // m^2, of all triangles up to each one
  double area_ = 0;
};

}  // namespace firn
