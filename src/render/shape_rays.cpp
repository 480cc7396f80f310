// SPDX-License-Identifier: MIT
#include "src/render/shape_rays.h"

#include <cmath>

namespace firn {
namespace {

// The first of two ordered distances that lies within (0, limit).
double first_within(double near, double far, double limit) {
  if (near > 0) return near < limit ? near : limit;
  return far > 0 && far < limit ? far : limit;
}

}  // namespace

double intersect(const Ball& ball, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  const double along = -o.dot(d);
  const double depth2 = ball.radius * ball.radius - (o + along * d).squaredNorm();
  if (depth2 < 0) return limit;
  const double half = std::sqrt(depth2);
  const double t = first_within(along - half, along + half, limit);
  if (t < limit) normal = (o + t * d) / ball.radius;
  return t;
}

double intersect(const Box& box, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  double t_in = -INFINITY, t_out = INFINITY;
  int axis_in = 0, axis_out = 0;
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0) {
      if (std::fabs(o[a]) > box.half_size[a]) return limit;
      continue;
    }
    const double t0 = (-std::copysign(box.half_size[a], d[a]) - o[a]) / d[a];
    const double t1 = (std::copysign(box.half_size[a], d[a]) - o[a]) / d[a];
    if (t0 > t_in) t_in = t0, axis_in = a;
    if (t1 < t_out) t_out = t1, axis_out = a;
  }
  if (t_in > t_out) return limit;
  const double t = first_within(t_in, t_out, limit);
  if (t < limit) {
    const bool entering = t == t_in;
    const int axis = entering ? axis_in : axis_out;
    normal = Vec3::Zero();
    normal[axis] = (d[axis] > 0) == entering ? -1 : 1;
  }
  return t;
}

// The interval inside the endless tube, cut by the interval between the caps.
double intersect(const Cylinder& cylinder, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  double t_in = -INFINITY, t_out = INFINITY;
  const double a = d.x() * d.x() + d.z() * d.z();
  const double c = o.x() * o.x() + o.z() * o.z() - cylinder.radius * cylinder.radius;
  if (a > 0) {
    const double b = o.x() * d.x() + o.z() * d.z(), along = -b / a;
    const double qx = o.x() + along * d.x(), qz = o.z() + along * d.z();
    const double depth2 = (cylinder.radius * cylinder.radius - qx * qx - qz * qz) / a;
    if (depth2 < 0) return limit;
    t_in = along - std::sqrt(depth2), t_out = along + std::sqrt(depth2);
  } else if (c > 0) {
    return limit;
  }
  bool cap_in = false, cap_out = false;
  if (d.y() != 0) {
    const double t0 = (-std::copysign(cylinder.half_height, d.y()) - o.y()) / d.y();
    const double t1 = (std::copysign(cylinder.half_height, d.y()) - o.y()) / d.y();
    if (t0 > t_in) t_in = t0, cap_in = true;
    if (t1 < t_out) t_out = t1, cap_out = true;
  } else if (std::fabs(o.y()) > cylinder.half_height) {
    return limit;
  }
  if (t_in > t_out) return limit;
  const double t = first_within(t_in, t_out, limit);
  if (t < limit) {
    const bool entering = t == t_in;
    const Vec3 p = o + t * d;
    if (entering ? cap_in : cap_out) {
      normal = Vec3(0, (d.y() > 0) == entering ? -1 : 1, 0);
    } else {
      normal = Vec3(p.x(), 0, p.z()).normalized();
    }
  }
  return t;
}

// Convex: of its tube and its two balls, what lies on its surface is the first way in and the last way out.
double intersect(const Capsule& capsule, const Vec3& o, const Vec3& d, double limit, Vec3& normal) {
  double t_in = INFINITY, t_out = -INFINITY;
  const auto cut = [&](double a, double b, double c, double offset) {  // a t^2 + 2 b t + c = 0
    const double root2 = b * b - a * c;
    if (!(a > 0) || root2 < 0) return;
    for (const double side : {-1.0, 1.0}) {
      const double t = (-b + side * std::sqrt(root2)) / a, y = o.y() + t * d.y();
      const bool part = offset == 0 ? std::fabs(y) <= capsule.half_length : y / offset >= 1;
      if (part) t_in = std::fmin(t_in, t), t_out = std::fmax(t_out, t);
    }
  };
  const double r2 = capsule.radius * capsule.radius;
  cut(d.x() * d.x() + d.z() * d.z(), o.x() * d.x() + o.z() * d.z(), o.x() * o.x() + o.z() * o.z() - r2, 0);
  for (const double end : {-capsule.half_length, capsule.half_length}) {
    if (end == 0) continue;
    const Vec3 from = o - Vec3(0, end, 0);
    cut(d.squaredNorm(), from.dot(d), from.squaredNorm() - r2, end);
  }
  if (!(t_in <= t_out)) return limit;
  const double t = first_within(t_in, t_out, limit);
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
