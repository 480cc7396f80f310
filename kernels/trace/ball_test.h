// SPDX-License-Identifier: MIT
// One ray against 16 balls, in projected form: q = c - (c.d) d is the ball's centre seen from the ray, |q|^2
// <= r^2 a hit. The textbook b^2 - (c.c - r^2) cancels: in float it loses balls that are a few hundred radii
// away.
#pragma once
#include "kernels/trace/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

struct Ray {
  float o[3];  // m
  float d[3];  // unit
};

struct Nearest {
  float t;  // m, reach or hit
  std::uint32_t particle;
};

inline Ray load_ray(const RayView& rays, std::size_t i) {
  return {{rays.origin[0][i], rays.origin[1][i], rays.origin[2][i]},
          {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]}};
}

template <bool kAny>
inline void test_bundles(const BallBundle* bundles, std::uint64_t begin, std::uint64_t end, const Ray& ray,
                         Nearest& best) {
  for (std::uint64_t b = begin; b < end; ++b) {
    const BallBundle& balls = bundles[b];
    const F16 cx = load16(balls.x) - ray.o[0];
    const F16 cy = load16(balls.y) - ray.o[1];
    const F16 cz = load16(balls.z) - ray.o[2];
    const F16 along = cx * ray.d[0] + cy * ray.d[1] + cz * ray.d[2];
    const F16 qx = cx - along * ray.d[0];
    const F16 qy = cy - along * ray.d[1];
    const F16 qz = cz - along * ray.d[2];
    const F16 depth2 = load16(balls.r2) - (qx * qx + qy * qy + qz * qz);
    if (bits16(depth2 >= 0.f) == 0) continue;
    const F16 t = along - sqrt16(depth2);  // NaN where missed: every comparison below is then false
    unsigned hits = bits16((t > 0.f) & (t < best.t));
    for (; hits != 0; hits &= hits - 1) {
      const int lane = __builtin_ctz(hits);
      if (t[lane] < best.t) best = {t[lane], balls.particle[lane]};
      if (kAny) return;
    }
  }
}

}  // namespace firn::kernels::FIRN_ISA
