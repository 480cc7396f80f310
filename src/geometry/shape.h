// SPDX-License-Identifier: MIT
// Shapes serve everything alike: snow is placed inside them, colliders push with them, rays hit them.
// A Shape is plain data: a form in its own local frame and a pose that carries it into the world.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "src/core/vector.h"

namespace firn {

class TriangleMesh;  // src/geometry/mesh.h
class HeightRaster;  // src/geometry/height_field.h

struct Ball {
  double radius = 0;  // m, centred on the local origin
};
struct Box {
  Vec3 half_size = Vec3::Zero();  // m, centred on the local origin
};
struct Cylinder {
  double radius = 0;       // m
  double half_height = 0;  // m, along local +-Y, centred on the local origin
};
struct Capsule {
  double radius = 0;       // m
  double half_length = 0;  // m, from the local origin to either end of its axis, along local +-Y
};
struct HalfSpace {};  // solid for local y <= 0; its boundary is an unbounded plane
struct HeightField {
  std::shared_ptr<const HeightRaster>
      raster;       // solid from `base` up to height(x, z), inside the raster's rectangle
  double base = 0;  // m
};
struct Mesh {
  std::shared_ptr<const TriangleMesh> mesh;  // closed, triangles counter-clockwise seen from outside
};

struct Pose {
  Mat3 rotation = Mat3::Identity();  // local to world
  Vec3 translation = Vec3::Zero();   // m
  Vec3 to_world(const Vec3& local) const { return rotation * local + translation; }
  Vec3 to_local(const Vec3& world) const { return rotation.transpose() * (world - translation); }
  Pose to_local(const Pose& world) const {
    return {rotation.transpose() * world.rotation, to_local(world.translation)};
  }
};

struct Shape {
  std::variant<Ball, Box, Cylinder, Capsule, HalfSpace, HeightField, Mesh> form;
  Pose pose;
};

// Signed distance to the shape's surface (m, negative inside) and the outward unit normal there (its
// gradient).
struct SurfaceDistance {
  double distance;
  Vec3 normal;
};
SurfaceDistance closest_surface(const Shape& shape, const Vec3& world);

// Negative inside. Exact for ball, box, cylinder, capsule, half space, mesh; for a height field the vertical
// distance scaled to first order by the slope, exact in sign.
double signed_distance(const Shape& shape, const Vec3& world);

// World bounds; for a HalfSpace, everything (min -inf, max +inf as +-1e300).
Bounds world_bounds(const Shape& shape);

// m^3; empty for a HalfSpace (unbounded).
std::optional<double> volume(const Shape& shape);

}  // namespace firn
