// SPDX-License-Identifier: MIT
#include "src/render/lights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "src/core/portable_math.h"
#include "src/render/directions.h"

namespace firn {
namespace {

float smooth(float x) {
  const float t = std::clamp(x, 0.f, 1.f);
  return t * t * (3 - 2 * t);
}

// The horizon's colour reaches up as in a clear sky (a steep start) and gives way to the ground's within 6
// degrees.
Vec3f sky_radiance(const SkyLight& sky, float y) {
  if (y < 0) return sky.horizon + smooth(-10 * y) * (sky.ground - sky.horizon);
  const float down = 1 - y;
  return sky.zenith + down * down * down * (sky.horizon - sky.zenith);
}

}  // namespace

LightSet::LightSet(std::vector<Light> lights) {
  for (const Light& light : lights) std::visit([this](const auto& one) { add(one); }, light);
}

void LightSet::add(const QuadLight& light) {
  const Vec3 cross = light.edge_u.cross(light.edge_v);
  if (!(cross.norm() > 0)) return;
  quads_.push_back({light.corner, Vec3f::Zero(), light.edge_u.cast<float>(), light.edge_v.cast<float>(),
                    cross.normalized().cast<float>(), light.radiance, static_cast<float>(cross.norm())});
}

void LightSet::add(const SphereLight& light) {
  if (light.radius > 0) {
    balls_.push_back({light.center, Vec3f::Zero(), light.radiance, static_cast<float>(light.radius)});
  }
}

// A disc of uniform radiance L and angular radius a sends pi L sin^2 a to a plane that faces it.
void LightSet::add(const SunLight& light) {
  const SinCos half = portable_sincos(0.5 * light.angular_radius * 3.14159265358979323846 / 180);
  const double spread = 2 * half.sin * half.sin;
  Sun sun{light.direction.normalized().cast<float>(), light.irradiance, Vec3f::Zero(),
          static_cast<float>(spread)};
  if (spread > 0)
    sun.radiance = light.irradiance / static_cast<float>(spread * (2 - spread) * 3.14159265358979323846);
  suns_.push_back(sun);
}

void LightSet::place(const Vec3& origin) {
  for (Quad& quad : quads_) quad.p = (quad.corner - origin).cast<float>();
  for (Ball& ball : balls_) ball.p = (ball.center - origin).cast<float>();
}

// An upper estimate of the irradiance at p, never 0 where there may be light.
float LightSet::weight(std::size_t light, const Vec3f& p) const {
  if (light < quads_.size()) {
    const Quad& quad = quads_[light];
    if (quad.normal.dot(p - quad.p) <= 0) return 0;
    const float d2 = (quad.p + 0.5f * (quad.u + quad.v) - p).squaredNorm();
    return quad.radiance.sum() * quad.area / (d2 + quad.area);
  }
  light -= quads_.size();
  if (light < balls_.size()) {
    const float r2 = balls_[light].radius * balls_[light].radius;
    return balls_[light].radiance.sum() * kPi * r2 / std::max((balls_[light].p - p).squaredNorm(), r2);
  }
  return suns_[light - balls_.size()].irradiance.sum();
}

bool LightSet::sample_quad(const Quad& quad, const Vec3f& p, Sample2 at, LightSample& out) const {
  const Vec3f to = quad.p + at.u * quad.u + at.v * quad.v - p;
  const float d2 = to.squaredNorm();
  out.distance = std::sqrt(d2);
  out.direction = to / out.distance;
  const float cosine = -out.direction.dot(quad.normal);
  if (!(cosine > 0) || !(d2 > 0)) return false;
  out.radiance_by_pdf = quad.radiance * (cosine * quad.area / d2);
  return true;
}

// Uniform over the cone that the ball fills, so every sample sees it.
bool LightSet::sample_ball(const Ball& ball, const Vec3f& p, Sample2 at, LightSample& out) const {
  const Vec3f to = ball.p - p;
  const float d2 = to.squaredNorm(), sin2 = ball.radius * ball.radius / d2;
  if (!(sin2 < 1)) return false;  // inside the light
  const float spread = sin2 / (1 + std::sqrt(1 - sin2));
  out.direction = cone_direction(to / std::sqrt(d2), spread, at);
  const float along = out.direction.dot(to);
  const float depth2 = ball.radius * ball.radius - (to - along * out.direction).squaredNorm();
  out.distance = along - std::sqrt(std::max(depth2, 0.f));
  out.radiance_by_pdf = ball.radiance * (2 * kPi * spread);
  return true;
}

bool LightSet::sample(const Vec3f& p, float choice, Sample2 at, LightSample& out) const {
  const std::size_t count = quads_.size() + balls_.size() + suns_.size();
  float total = 0;
  for (std::size_t i = 0; i < count; ++i) total += weight(i, p);
  if (!(total > 0)) return false;
  std::size_t chosen = 0;
  float chance = 0;
  float left = choice * total;
  for (std::size_t i = 0; i < count; ++i) {
    const float w = weight(i, p);
    if (!(w > 0)) continue;
    chosen = i, chance = w / total;
    left -= w;
    if (left < 0) break;
  }
  if (chosen < quads_.size()) {
    if (!sample_quad(quads_[chosen], p, at, out)) return false;
  } else if (chosen < quads_.size() + balls_.size()) {
    if (!sample_ball(balls_[chosen - quads_.size()], p, at, out)) return false;
  } else {
    const Sun& sun = suns_[chosen - quads_.size() - balls_.size()];
    out.direction = cone_direction(sun.direction, sun.spread, at);
    out.distance = std::numeric_limits<float>::infinity();
    out.radiance_by_pdf = sun.irradiance * (2 / (2 - sun.spread));
  }
  out.radiance_by_pdf /= chance;
  return true;
}

bool LightSet::hit(const Vec3f& o, const Vec3f& d, float& t, Vec3f& radiance) const {
  bool found = false;
  for (const Quad& quad : quads_) {
    const float along = d.dot(quad.normal), reach = (quad.p - o).dot(quad.normal) / along;
    if (!(along < 0) || !(reach > 0) || !(reach < t)) continue;
    const Vec3f at = o + reach * d - quad.p;
    const float u = quad.normal.dot(at.cross(quad.v)) / quad.area,
                v = quad.normal.dot(quad.u.cross(at)) / quad.area;
    if (u < 0 || u > 1 || v < 0 || v > 1) continue;
    t = reach, radiance = quad.radiance, found = true;
  }
  for (const Ball& ball : balls_) {
    const Vec3f to = ball.p - o;
    const float along = d.dot(to), depth2 = ball.radius * ball.radius - (to - along * d).squaredNorm();
    if (depth2 < 0) continue;
    const float reach = along - std::sqrt(depth2);
    if (!(reach > 0) || !(reach < t)) continue;
    t = reach, radiance = ball.radiance, found = true;
  }
  return found;
}

Vec3f LightSet::escape(const Vec3f& d, bool see_sun) const {
  Vec3f sum = constant_;
  for (const SkyLight& sky : skies_) sum += sky_radiance(sky, d.y());
  if (!see_sun) return sum;
  for (const Sun& sun : suns_) {
    const float apart2 = (d - sun.direction).squaredNorm();  // 2 - 2 cos, without cancellation
    if (apart2 < 2 * sun.spread) sum += sun.radiance;
  }
  return sum;
}

}  // namespace firn
