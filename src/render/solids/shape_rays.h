// SPDX-License-Identifier: MIT
// Rays against the analytic shapes, in the shape's own frame: the distance of the nearest surface at 0 < t <
// limit, met from outside or inside, or `limit`. `normal` (outward, unit) is set on a hit.
#pragma once
#include <cmath>

#include "src/geometry/shape.h"

namespace firn {

// The part of a ray (the whole line: distances may be negative) that lies inside a shape.
struct Span {
  double in = 1, out = 0;  // m
  bool empty() const { return !(in <= out); }
};
inline Span inside(const Ball& ball, const Vec3& o, const Vec3& d) {
  const double along = -o.dot(d);
  const double depth2 = ball.radius * ball.radius - (o + along * d).squaredNorm();
  if (depth2 < 0) return {};
  const double depth = std::sqrt(depth2);
  return {along - depth, along + depth};
}
Span inside(const Box& box, const Vec3& o, const Vec3& d);
Span inside(const Cylinder& cylinder, const Vec3& o, const Vec3& d);
Span inside(const Capsule& capsule, const Vec3& o, const Vec3& d);
Span inside(const HalfSpace& plane, const Vec3& o, const Vec3& d);

double intersect(const Ball& ball, const Vec3& o, const Vec3& d, double limit, Vec3& normal);
double intersect(const Box& box, const Vec3& o, const Vec3& d, double limit, Vec3& normal);
double intersect(const Cylinder& cylinder, const Vec3& o, const Vec3& d, double limit, Vec3& normal);
double intersect(const Capsule& capsule, const Vec3& o, const Vec3& d, double limit, Vec3& normal);
double intersect(const HalfSpace& plane, const Vec3& o, const Vec3& d, double limit, Vec3& normal);

}  // namespace firn
