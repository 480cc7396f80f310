// SPDX-License-Identifier: MIT
#include "src/render/solids/shape_rays.h"

#include <cmath>

namespace firn {
namespace {

// The first of two ordered distances that lies within (0, limit).
double first_within(double near, double far, double limit) {
  if (near > 0) return near < limit ? near : limit;
  return far > 0 && far < limit ? far : limit;
}

// Cuts `span` to the part of the ray between two planes at -half and half of an axis.
Span between(double half, double o, double d) {
  if (d == 0) return std::fabs(o) > half ? Span{} : Span{-INFINITY, INFINITY};
  return {(-std::copysign(half, d) - o) / d, (std::copysign(half, d) - o) / d};
}
Span both(const Span& a, const Span& b) { return {std::fmax(a.in, b.in), std::fmin(a.out, b.out)}; }

// Inside the endless tube around the y axis.
Span tube(double radius, const Vec3& o, const Vec3& d) {
  const double a = d.x() * d.x() + d.z() * d.z();
  if (!(a > 0)) {
    const bool inside = o.x() * o.x() + o.z() * o.z() <= radius * radius;
    return inside ? Span{-INFINITY, INFINITY} : Span{};
  }
  const double along = -(o.x() * d.x() + o.z() * d.z()) / a;
  const double qx = o.x() + along * d.x(), qz = o.z() + along * d.z();
  const double depth2 = (radius * radius - qx * qx - qz * qz) / a;
  if (depth2 < 0) return {};
  return {along - std::sqrt(depth2), along + std::sqrt(depth2)};
}

}  // namespace

Span inside(const Box& box, const Vec3& o, const Vec3& d) {
  Span span{-INFINITY, INFINITY};
  for (int a = 0; a < 3; ++a) span = both(span, between(box.half_size[a], o[a], d[a]));
  return span;
}

Span inside(const Cylinder& cylinder, const Vec3& o, const Vec3& d) {
  return both(tube(cylinder.radius, o, d), between(cylinder.half_height, o.y(), d.y()));
}

// Convex: of its tube and its two balls, what lies on its surface is the first way in and the last way out.
Span inside(const Capsule& capsule, const Vec3& o, const Vec3& d) {
  Span span{INFINITY, -INFINITY};
  const auto cut = [&](double a, double b, double c, double offset) {  // a t^2 + 2 b t + c = 0
    const double root2 = b * b - a * c;
    if (!(a > 0) || root2 < 0) return;
    for (const double side : {-1.0, 1.0}) {
      const double t = (-b + side * std::sqrt(root2)) / a, y = o.y() + t * d.y();
      const bool part = offset == 0 ? std::fabs(y) <= capsule.half_length : y / offset >= 1;
      if (part) span = {std::fmin(span.in, t), std::fmax(span.out, t)};
    }
  };
  const double r2 = capsule.radius * capsule.radius;
  cut(d.x() * d.x() + d.z() * d.z(), o.x() * d.x() + o.z() * d.z(), o.x() * o.x() + o.z() * o.z() - r2, 0);
  for (const double end : {-capsule.half_length, capsule.half_length}) {
    if (end == 0) continue;
    const Vec3 from = o - Vec3(0, end, 0);
    cut(d.squaredNorm(), from.dot(d), from.squaredNorm() - r2, end);
  }
  return span;
}

Span inside(const HalfSpace&, const Vec3& o, const Vec3& d) {
  const double t = -o.y() / d.y();
  if (d.y() == 0) return o.y() > 0 ? Span{} : Span{-INFINITY, INFINITY};
  return d.y() > 0 ? Span{-INFINITY, t} : Span{t, INFINITY};
}

double intersect(const Ball& ball, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  const Span span = inside(ball, o, d);
  if (span.empty()) return limit;
  const double t = first_within(span.in, span.out, limit);
  if (t < limit) normal = (o + t * d) / ball.radius;
  return t;
}

double intersect(const Box& box, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  const Span span = inside(box, o, d);
  if (span.empty()) return limit;
  const double t = first_within(span.in, span.out, limit);
  if (!(t < limit)) return limit;
  const bool entering = t == span.in;
  normal = Vec3::Zero();
  for (int a = 0; a < 3; ++a) {
    const Span slab = between(box.half_size[a], o[a], d[a]);
    if (d[a] == 0 || t != (entering ? slab.in : slab.out)) continue;
    normal[a] = (d[a] > 0) == entering ? -1 : 1;
    break;
  }
  return t;
}

double intersect(const Cylinder& cylinder, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  const Span span = inside(cylinder, o, d);
  if (span.empty()) return limit;
  const double t = first_within(span.in, span.out, limit);
  if (!(t < limit)) return limit;
  const bool entering = t == span.in;
  const Span round = tube(cylinder.radius, o, d);
  const Vec3 p = o + t * d;
  normal = t == (entering ? round.in : round.out) ? Vec3(Vec3(p.x(), 0, p.z()).normalized())
                                                  : Vec3(0, (d.y() > 0) == entering ? -1 : 1, 0);
  return t;
}

double intersect(const Capsule& capsule, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  const Span span = inside(capsule, o, d);
  if (span.empty()) return limit;
  const double t = first_within(span.in, span.out, limit);
  if (t < limit) {
    const Vec3 p = o + t * d;
    normal =
        (p - Vec3(0, std::fmin(std::fmax(p.y(), -capsule.half_length), capsule.half_length), 0)).normalized();
  }
  return t;
}

double intersect(const HalfSpace&, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  if (d.y() == 0) return limit;
  const double t = -o.y() / d.y();
  if (!(t > 0 && t < limit)) return limit;
  normal = Vec3(0, 1, 0);
  return t;
}

}  // namespace firn
