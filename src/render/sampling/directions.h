// SPDX-License-Identifier: MIT
// Directions about an axis: frames, cosine and cone sampling.
#pragma once
#include <cmath>

#include "src/core/portable_math.h"
#include "src/core/vector.h"
#include "src/render/sampling/sampler.h"

namespace firn {

constexpr float kPi = 3.14159265358979f;

// Carries (x, y, z) of a right-handed frame whose third axis is the unit vector n into the world (Duff et al.
// 2017).
inline Vec3f around(const Vec3f& n, float x, float y, float z) {
  const float sign = n.z() < 0 ? -1.f : 1.f;
  const float a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
  const Vec3f s(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()),
      t(b, sign + n.y() * n.y() * a, -n.y());
  return x * s + y * t + z * n;
}

struct Disc {
  float x, y;
};
// Angle 2 pi u at radius r; u in [0, 1].
inline Disc on_circle(float r, float u) {
  const SinCosf angle = portable_sincos_turn(u);
  return {r * angle.cos, r * angle.sin};
}

// Density cos/pi over the hemisphere about n.
inline Vec3f cosine_direction(const Vec3f& n, Sample2 at) {
  const Disc disc = on_circle(std::sqrt(at.u), at.v);
  return around(n, disc.x, disc.y, std::sqrt(1 - at.u)).normalized();
}

// Uniform over the cone about `axis` whose 1 - cos(half angle) is `spread`.
inline Vec3f cone_direction(const Vec3f& axis, float spread, Sample2 at) {
  const float v = at.u * spread;
  const Disc disc = on_circle(std::sqrt(v * (2 - v)), at.v);
  return around(axis, disc.x, disc.y, 1 - v).normalized();
}

}  // namespace firn
