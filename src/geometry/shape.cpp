// SPDX-License-Identifier: MIT
// Signed distances, bounds and volumes of every form. Each form answers in its own local frame; the pose
// carries the answer into the world. Formulas: Quilez, "Distance functions" (ball, box, cylinder, capsule);
// the others in mesh and height_field.
#include "src/geometry/shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/geometry/height_field.h"
#include "src/geometry/mesh.h"

namespace firn {
namespace {

SurfaceDistance local_surface(const Ball& ball, const Vec3& p) {
  const double length = p.norm();
  return {length - ball.radius, length > 0 ? Vec3(p / length) : Vec3::UnitY()};
}

SurfaceDistance local_surface(const Box& box, const Vec3& p) {
  const Vec3 q = p.cwiseAbs() - box.half_size;
  const Vec3 sign = p.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; });
  const Vec3 outside = q.cwiseMax(0.0);
  const double length = outside.norm();
  if (length > 0) return {length, outside.cwiseProduct(sign) / length};
  int axis = 0;
  const double depth = q.maxCoeff(&axis);
  return {depth, Vec3(Vec3::Unit(axis) * sign[axis])};
}

SurfaceDistance local_surface(const Cylinder& cylinder, const Vec3& p) {
  const double across = std::hypot(p.x(), p.z());
  const Vec3 radial = across > 0 ? Vec3(p.x() / across, 0, p.z() / across) : Vec3::UnitX();
  const Vec3 axial(0, p.y() < 0 ? -1 : 1, 0);
  const double dr = across - cylinder.radius, dy = std::abs(p.y()) - cylinder.half_height;
  if (dr > 0 && dy > 0) {
    const double length = std::hypot(dr, dy);
    return {length, (radial * dr + axial * dy) / length};
  }
  return dr > dy ? SurfaceDistance{dr, radial} : SurfaceDistance{dy, axial};
}

SurfaceDistance local_surface(const Capsule& capsule, const Vec3& p) {
  const Vec3 axis(0, std::clamp(p.y(), -capsule.half_length, capsule.half_length), 0);
  return local_surface(Ball{capsule.radius}, p - axis);
}

SurfaceDistance local_surface(const HalfSpace&, const Vec3& p) { return {p.y(), Vec3::UnitY()}; }

// The largest of the distances to the surface (to first order), to the base and to the four sides.
SurfaceDistance local_surface(const HeightField& field, const Vec3& p) {
  const HeightRaster& raster = *field.raster;
  const HeightSample top = raster.sample(p.x(), p.z());
  const Vec3 up = Vec3(-top.slope_x, 1, -top.slope_z).normalized();
  SurfaceDistance result{(p.y() - top.height) * up.y(), up};
  const auto cut = [&result](double distance, const Vec3& normal) {
    if (distance > result.distance) result = {distance, normal};
  };
  cut(field.base - p.y(), -Vec3::UnitY());
  cut(std::abs(p.x()) - 0.5 * raster.width(), Vec3(p.x() < 0 ? -1 : 1, 0, 0));
  cut(std::abs(p.z()) - 0.5 * raster.depth(), Vec3(0, 0, p.z() < 0 ? -1 : 1));
  return result;
}

SurfaceDistance local_surface(const Mesh& mesh, const Vec3& p) {
  const TriangleMesh::Closest closest = mesh.mesh->closest(p);
  const double distance = closest.signed_distance;
  // Near the surface the offset has no direction left in it: the pseudonormal is the gradient's limit there.
  const double near = 1e-9 * mesh.mesh->bounds().size().norm();
  return {distance, std::abs(distance) < near ? closest.normal : Vec3((p - closest.point) / distance)};
}

Bounds symmetric(const Vec3& half) { return {-half, half}; }

Bounds local_bounds(const Ball& ball) { return symmetric(Vec3::Constant(ball.radius)); }
Bounds local_bounds(const Box& box) { return symmetric(box.half_size); }
Bounds local_bounds(const Cylinder& c) { return symmetric(Vec3(c.radius, c.half_height, c.radius)); }
Bounds local_bounds(const Capsule& c) {
  return symmetric(Vec3(c.radius, c.half_length + c.radius, c.radius));
}
Bounds local_bounds(const HalfSpace&) { return {Vec3::Constant(-1e300), Vec3::Constant(1e300)}; }
Bounds local_bounds(const HeightField& field) {
  const Vec3 half(0.5 * field.raster->width(), 0, 0.5 * field.raster->depth());
  const double low = std::min(field.base, field.raster->lowest());
  return {-half + Vec3(0, low, 0), half + Vec3(0, field.raster->highest(), 0)};
}
Bounds local_bounds(const Mesh& mesh) { return mesh.mesh->bounds(); }

std::optional<double> local_volume(const Ball& ball) {
  return 4.0 / 3.0 * std::numbers::pi * std::pow(ball.radius, 3);
}
std::optional<double> local_volume(const Box& box) { return 8 * box.half_size.prod(); }
std::optional<double> local_volume(const Cylinder& c) {
  return 2 * std::numbers::pi * c.radius * c.radius * c.half_height;
}
std::optional<double> local_volume(const Capsule& c) {
  return *local_volume(Ball{c.radius}) + *local_volume(Cylinder{c.radius, c.half_length});
}
std::optional<double> local_volume(const HalfSpace&) { return std::nullopt; }
std::optional<double> local_volume(const HeightField& field) {
  return field.raster->volume_above(field.base);
}
std::optional<double> local_volume(const Mesh& mesh) { return mesh.mesh->volume(); }

}  // namespace

SurfaceDistance closest_surface(const Shape& shape, const Vec3& world) {
  const Vec3 local = shape.pose.to_local(world);
  SurfaceDistance point =
      std::visit([&](const auto& form) { return local_surface(form, local); }, shape.form);
  point.normal = shape.pose.rotation * point.normal;
  return point;
}

double signed_distance(const Shape& shape, const Vec3& world) {
  return closest_surface(shape, world).distance;
}

Bounds world_bounds(const Shape& shape) {
  Bounds local = std::visit([](const auto& form) { return local_bounds(form); }, shape.form);
  if (std::holds_alternative<HalfSpace>(shape.form)) return local;
  if (std::holds_alternative<Ball>(shape.form)) {
    return {local.min + shape.pose.translation, local.max + shape.pose.translation};
  }
  Bounds world;
  for (int corner = 0; corner < 8; ++corner) {
    world.include(shape.pose.to_world(Vec3(corner & 1 ? local.max.x() : local.min.x(),
                                           corner & 2 ? local.max.y() : local.min.y(),
                                           corner & 4 ? local.max.z() : local.min.z())));
  }
  return world;
}

std::optional<double> volume(const Shape& shape) {
  return std::visit([](const auto& form) { return local_volume(form); }, shape.form);
}

}  // namespace firn
