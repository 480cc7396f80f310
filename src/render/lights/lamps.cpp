// SPDX-License-Identifier: MIT
#include "src/render/lights/lamps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "src/render/sampling/directions.h"

namespace firn {
namespace {

// Uniform area as seen from p; false where it is seen from behind.
bool see(const Vec3f& p, const LampPoint& point, float area, LampSight& out) {
  const Vec3f to = point.p - p;
  const float d2 = to.squaredNorm();
  out.distance = std::sqrt(d2);
  out.direction = to / out.distance;
  out.cosine = -out.direction.dot(point.normal);
  if (!(out.cosine > 0) || !(d2 > 0)) return false;
  out.pdf = d2 / (out.cosine * area);
  return true;
}

Vec3f on_sphere(Sample2 at) {
  const float z = 1 - 2 * at.u;
  const Disc disc = on_circle(std::sqrt(std::max(0.f, 1 - z * z)), at.v);
  return {disc.x, disc.y, z};
}

}  // namespace

QuadLamp::QuadLamp(const QuadLight& light)
    : corner_(light.corner),
      p_(Vec3f::Zero()),
      u_(light.edge_u.cast<float>()),
      v_(light.edge_v.cast<float>()),
      normal_(light.edge_u.cross(light.edge_v).normalized().cast<float>()) {
  radiance = light.radiance;
  area = static_cast<float>(light.edge_u.cross(light.edge_v).norm());
  strength = radiance.sum();
}

void QuadLamp::place(const Vec3& origin) { p_ = (corner_ - origin).cast<float>(); }

float QuadLamp::weight(const Vec3f& p) const {
  if (normal_.dot(p - p_) <= 0) return 0;
  const float d2 = (p_ + 0.5f * (u_ + v_) - p).squaredNorm();
  return strength * area / (d2 + area);
}

bool QuadLamp::toward(const Vec3f& p, Sample2 at, LampSight& out) const {
  return see(p, point(at), area, out);
}

float QuadLamp::density(const Vec3f&, float distance, float cosine) const {
  return cosine > 0 ? distance * distance / (cosine * area) : 0;
}

LampPoint QuadLamp::point(Sample2 at) const { return {p_ + at.u * u_ + at.v * v_, normal_}; }

bool QuadLamp::hit(const Vec3f& o, const Vec3f& d, float& t, float& cosine) const {
  const float along = d.dot(normal_), reach = (p_ - o).dot(normal_) / along;
  if (!(along < 0) || !(reach > 0) || !(reach < t)) return false;
  const Vec3f at = o + reach * d - p_;
  const float u = normal_.dot(at.cross(v_)) / area, v = normal_.dot(u_.cross(at)) / area;
  if (u < 0 || u > 1 || v < 0 || v > 1) return false;
  t = reach, cosine = -along;
  return true;
}

BallLamp::BallLamp(const SphereLight& light)
    : center_(light.center), p_(Vec3f::Zero()), radius_(static_cast<float>(light.radius)) {
  radiance = light.radiance;
  area = 4 * kPi * radius_ * radius_;
  strength = radiance.sum();
}

void BallLamp::place(const Vec3& origin) { p_ = (center_ - origin).cast<float>(); }

float BallLamp::weight(const Vec3f& p) const {
  const float d2 = (p_ - p).squaredNorm(), r2 = radius_ * radius_;
  return d2 > r2 ? strength * kPi * r2 / d2 : 0;
}

// Uniform over the cone that the ball fills, so every sample sees it.
bool BallLamp::toward(const Vec3f& p, Sample2 at, LampSight& out) const {
  const Vec3f to = p_ - p;
  const float d2 = to.squaredNorm(), r2 = radius_ * radius_, sin2 = r2 / d2;
  if (!(sin2 < 1)) return false;  // inside the lamp
  out.direction = cone_direction(to / std::sqrt(d2), sin2 / (1 + std::sqrt(1 - sin2)), at);
  const float along = out.direction.dot(to);
  const float depth = std::sqrt(std::max(r2 - (to - along * out.direction).squaredNorm(), 0.f));
  out.distance = along - depth;
  out.cosine = depth / radius_;
  out.pdf = density(p, out.distance, out.cosine);
  return out.pdf > 0;
}

float BallLamp::density(const Vec3f& p, float, float) const {
  const float sin2 = radius_ * radius_ / (p_ - p).squaredNorm();
  return sin2 < 1 ? (1 + std::sqrt(1 - sin2)) / (2 * kPi * sin2) : 0;
}

LampPoint BallLamp::point(Sample2 at) const {
  const Vec3f normal = on_sphere(at);
  return {p_ + radius_ * normal, normal};
}

bool BallLamp::hit(const Vec3f& o, const Vec3f& d, float& t, float& cosine) const {
  const Vec3f to = p_ - o;
  const float along = d.dot(to), depth2 = radius_ * radius_ - (to - along * d).squaredNorm();
  if (depth2 < 0) return false;
  const float depth = std::sqrt(depth2), reach = along - depth;
  if (!(reach > 0) || !(reach < t)) return false;
  t = reach, cosine = depth / radius_;
  return true;
}

ObjectLamp::ObjectLamp(std::shared_ptr<const SurfaceArea> surface, const Vec3f& light)
    : surface_(std::move(surface)) {
  radiance = light;
  area = static_cast<float>(surface_->area());
  strength = radiance.sum();
}

void ObjectLamp::place(const Pose& pose, const Shape& shape, const Vec3& center) {
  if (!(area > 0)) return;
  pose_ = pose;
  const Bounds bounds = world_bounds({shape.form, Pose{}});
  middle_ = pose.to_world(bounds.center()).cast<float>();
  radius_ = static_cast<float>(0.5 * bounds.size().norm());
  inward_ = signed_distance({shape.form, pose}, center) < 0;
}

// A convex body shows half of its surface at most, and no more than the ball that holds it.
float ObjectLamp::weight(const Vec3f& p) const {
  if (!(area > 0)) return 0;
  const float r2 = radius_ * radius_;
  return strength * std::min(0.5f * area, kPi * r2) / std::max((middle_ - p).squaredNorm(), r2);
}

bool ObjectLamp::toward(const Vec3f& p, Sample2 at, LampSight& out) const {
  return see(p, point(at), area, out);
}

float ObjectLamp::density(const Vec3f&, float distance, float cosine) const {
  return area > 0 && cosine > 0 ? distance * distance / (cosine * area) : 0;
}

LampPoint ObjectLamp::point(Sample2 at) const {
  const SurfaceArea::Point local = surface_->point(at);
  const Vec3 normal = pose_.rotation * local.normal;
  return {pose_.to_world(local.p).cast<float>(), (inward_ ? Vec3(-normal) : normal).cast<float>()};
}

Box3f QuadLamp::box() const {
  Box3f box(p_);
  for (const Vec3f& corner : {Vec3f(p_ + u_), Vec3f(p_ + v_), Vec3f(p_ + u_ + v_)}) box.extend(corner);
  return box;
}

Box3f BallLamp::box() const { return {p_ - Vec3f::Constant(radius_), p_ + Vec3f::Constant(radius_)}; }

}  // namespace firn
