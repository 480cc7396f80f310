// SPDX-License-Identifier: MIT
#include "src/render/snow/surface_area.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "src/core/portable_math.h"

namespace firn {
namespace {

double area_of(const Ball& ball) { return 4 * std::numbers::pi * ball.radius * ball.radius; }
double area_of(const Box& box) {
  const Vec3& h = box.half_size;
  return 8 * (h.y() * h.z() + h.z() * h.x() + h.x() * h.y());
}
double area_of(const Cylinder& c) { return 2 * std::numbers::pi * c.radius * (c.radius + 2 * c.half_height); }
double area_of(const Capsule& c) { return 4 * std::numbers::pi * c.radius * (c.radius + c.half_length); }
template <class Other>
double area_of(const Other&) {
  return 0;
}

// The horizontal direction of angle 2 pi u.
Vec3 around_y(double u) {
  const SinCos angle = portable_sincos(2 * std::numbers::pi * u);
  return {angle.sin, 0, angle.cos};
}

Vec3 on_unit_ball(double y, double u) {
  return std::sqrt(std::max(0.0, 1 - y * y)) * around_y(u) + y * Vec3::UnitY();
}

SurfaceArea::Point point_of(const Ball& ball, double u, double v) {
  const Vec3 normal = on_unit_ball(1 - 2 * u, v);
  return {ball.radius * normal, normal};
}

// The faces of each axis in turn; u is stretched again over the face that it chose.
SurfaceArea::Point point_of(const Box& box, double u, double v) {
  const Vec3& h = box.half_size;
  double left = u * area_of(box);
  for (int axis = 0;; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    const double face = 4 * h[b] * h[c];
    if (left >= 2 * face && axis < 2) {
      left -= 2 * face;
      continue;
    }
    const double side = left < face ? 1 : -1, along = side > 0 ? left / face : left / face - 1;
    SurfaceArea::Point point{Vec3::Zero(), Vec3::Zero()};
    point.normal[axis] = side;
    point.p[axis] = side * h[axis];
    point.p[b] = (2 * std::min(along, 1.0) - 1) * h[b];
    point.p[c] = (2 * v - 1) * h[c];
    return point;
  }
}

SurfaceArea::Point point_of(const Cylinder& c, double u, double v) {
  const double cap = c.radius / (2 * (c.radius + 2 * c.half_height));  // the part of one cap
  const Vec3 out = around_y(v);
  if (u < 2 * cap) {
    const double side = u < cap ? 1 : -1, r = std::sqrt(u < cap ? u / cap : u / cap - 1);
    return {r * c.radius * out + side * c.half_height * Vec3::UnitY(), side * Vec3::UnitY()};
  }
  const double y = (u - 2 * cap) / (1 - 2 * cap);
  return {c.radius * out + (2 * y - 1) * c.half_height * Vec3::UnitY(), out};
}

// By Archimedes the area of ball and tube alike is even in height.
SurfaceArea::Point point_of(const Capsule& c, double u, double v) {
  const double y = (2 * u - 1) * (c.radius + c.half_length);
  const double end = std::clamp(y, -c.half_length, c.half_length);
  const Vec3 normal = on_unit_ball((y - end) / c.radius, v);
  return {c.radius * normal + end * Vec3::UnitY(), normal};
}

template <class Other>
SurfaceArea::Point point_of(const Other&, double, double) {
  return {Vec3::Zero(), Vec3::UnitY()};
}

}  // namespace

SurfaceArea::SurfaceArea(const Shape& shape, std::shared_ptr<const TriangleSet> triangles)
    : shape_(shape), triangles_(std::move(triangles)) {
  area_ = std::visit([](const auto& form) { return area_of(form); }, shape.form);
  if (!triangles_) return;
  const auto& vertices = triangles_->vertices();
  for (const Triangle& corner : triangles_->triangles()) {
    const Vec3& a = vertices[corner[0]];
    const Vec3 cross = (vertices[corner[1]] - a).cross(vertices[corner[2]] - a);
    until_.push_back(area_ += 0.5 * cross.norm());
  }
}

SurfaceArea::Point SurfaceArea::point(Sample2 at) const {
  const double u = at.u, v = at.v;
  if (!triangles_) return std::visit([u, v](const auto& form) { return point_of(form, u, v); }, shape_.form);
  const auto found = std::upper_bound(until_.begin(), until_.end() - 1, u * area_);
  const auto index = static_cast<std::size_t>(found - until_.begin());
  const double before = index > 0 ? until_[index - 1] : 0;
  const double s = std::sqrt(std::clamp((u * area_ - before) / (until_[index] - before), 0.0, 1.0));
  const Triangle& corner = triangles_->triangles()[index];
  const Vec3& a = triangles_->vertices()[corner[0]];
  const Vec3 ab = triangles_->vertices()[corner[1]] - a, ac = triangles_->vertices()[corner[2]] - a;
  return {a + s * ((1 - v) * ab + v * ac), ab.cross(ac).normalized()};
}

}  // namespace firn
