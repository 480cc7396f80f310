// SPDX-License-Identifier: MIT
// Rays against balls, in projected form: q = c - (c.d) d is the ball's centre seen from the ray, |q|^2 <= r^2
// a hit. The textbook b^2 - (c.c - r^2) cancels: in float it loses balls that are a few hundred radii away.
// Lanes are balls (one ray) or rays (one ball); the arithmetic is one and the same, and of equal distances
// the lower index wins, so that every way of asking gives the same bits.
#pragma once
#include "kernels/simd/lanes.h"
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

FIRN_INLINE Ray load_ray(const RayView& rays, std::size_t i) {
  return {{rays.origin[0][i], rays.origin[1][i], rays.origin[2][i]},
          {rays.direction[0][i], rays.direction[1][i], rays.direction[2][i]}};
}

// c: from the ray's origin to the ball's centre. `along` is c.d; the result is r^2 - |q|^2, negative for a
// miss.
FIRN_INLINE Floats project(const Floats c[3], const Floats d[3], Floats r2, Floats& along) {
  along = fma(c[2], d[2], fma(c[1], d[1], c[0] * d[0]));
  const Floats qx = fma(-along, d[0], c[0]);
  const Floats qy = fma(-along, d[1], c[1]);
  const Floats qz = fma(-along, d[2], c[2]);
  return r2 - fma(qz, qz, fma(qy, qy, qx * qx));
}

// False where along - sqrt(depth2), which lies within [along - r, along], cannot be a distance in (0, reach]:
// this tells most balls, and roots are slow.
FIRN_INLINE Mask may_enter(Floats depth2, Floats along, Floats r, Floats reach) {
  return less_equal(splat(0), depth2) & less(splat(0), along) & less_equal(along - r, reach);
}

// Whether along - sqrt(depth2) is a distance in (0, reach], by squares: all ways of asking for any hit ask
// this.
FIRN_INLINE Mask blocks(Floats depth2, Floats along, Floats reach) {
  const Floats beyond = max(along - reach, splat(0));
  return less_equal(beyond * beyond, depth2) & less(splat(0), along) & less(depth2, along * along);
}

// One ray against a register of balls, whose sorted indices are particle(lane). A negative r2 is never hit;
// no radius is larger than most_r.
template <class Particle>
FIRN_INLINE void test_lanes(const Floats c[3], const Floats d[3], Floats r2, float most_r, Particle particle,
                            Nearest& best) {
  Floats along;
  const Floats depth2 = project(c, d, r2, along);
  if (!any(may_enter(depth2, along, splat(most_r), splat(best.t)))) return;
  const Floats t = along - sqrt(depth2);  // NaN where missed: every comparison is then false
  int hits = lane_bits(less(splat(0), t) & less_equal(t, splat(best.t)));
  if (hits == 0) return;
  float distance[kLanes];
  store(distance, t);
  for (; hits != 0; hits &= hits - 1) {
    const int lane = __builtin_ctz(static_cast<unsigned>(hits));
    if (distance[lane] < best.t || (distance[lane] == best.t && particle(lane) < best.particle)) {
      best = {distance[lane], particle(lane)};
    }
  }
}

template <bool kAny>
FIRN_INLINE void test_bundles(const BallBundle* bundles, std::uint64_t begin, std::uint64_t end,
                              const Ray& ray, Nearest& best) {
  const Floats d[3] = {splat(ray.d[0]), splat(ray.d[1]), splat(ray.d[2])};
  for (std::uint64_t b = begin; b < end; ++b) {
    const BallBundle& balls = bundles[b];
    for (int part = 0; part < kRayLanes; part += kLanes) {
      const Floats c[3] = {load(balls.x + part) - ray.o[0], load(balls.y + part) - ray.o[1],
                           load(balls.z + part) - ray.o[2]};
      test_lanes(
          c, d, load(balls.r2 + part), __builtin_huge_valf(),
          [&](int lane) { return balls.particle[part + lane]; }, best);
      if (kAny && best.particle != kNoHit) return;
    }
  }
}

// m, of the first `some` of the sorted balls from b on; the others are not hit.
FIRN_INLINE Floats radii(const TraceGrid& grid, std::uint64_t b, int some) {
  if (grid.radius != nullptr) return load_first(grid.radius + b, some, -1.f);
  return some >= kLanes ? splat(grid.max_radius)
                        : select(mask_of_first(some), splat(grid.max_radius), splat(-1));
}

// Calls test(c, r, b) for each register of a run of the sorted columns: from the ray's origin to their
// centres, their radii, and the index of the first.
template <class Test>
FIRN_INLINE void for_each_ball_register(const TraceGrid& grid, std::uint64_t begin, std::uint64_t end,
                                        const Ray& ray, Test&& test) {
  for (std::uint64_t b = begin; b < end; b += kLanes) {
    const int count = end - b < kLanes ? static_cast<int>(end - b) : kLanes;
    const Floats c[3] = {load_first(grid.x + b, count, 0.f) - ray.o[0],
                         load_first(grid.y + b, count, 0.f) - ray.o[1],
                         load_first(grid.z + b, count, 0.f) - ray.o[2]};
    test(c, radii(grid, b, count), b);
  }
}

// The same over a run of the sorted columns.
inline void test_run(const TraceGrid& grid, std::uint64_t begin, std::uint64_t end, const Ray& ray,
                     Nearest& best) {
  const Floats d[3] = {splat(ray.d[0]), splat(ray.d[1]), splat(ray.d[2])};
  for_each_ball_register(grid, begin, end, ray, [&](const Floats c[3], Floats r, std::uint64_t b) {
    test_lanes(
        c, d, r * abs(r), grid.max_radius, [&](int lane) { return static_cast<std::uint32_t>(b) + lane; },
        best);
  });
}

// Whether one of them blocks the ray.
inline bool run_blocks(const TraceGrid& grid, std::uint64_t begin, std::uint64_t end, const Ray& ray,
                       float reach) {
  const Floats d[3] = {splat(ray.d[0]), splat(ray.d[1]), splat(ray.d[2])};
  bool blocked = false;
  for_each_ball_register(grid, begin, end, ray, [&](const Floats c[3], Floats r, std::uint64_t) {
    Floats along;
    const Floats depth2 = project(c, d, r * abs(r), along);
    blocked |= any(blocks(depth2, along, splat(reach)));
  });
  return blocked;
}

// And over a cell's list.
template <bool kAny>
FIRN_INLINE void test_list(const TraceGrid& grid, std::uint32_t word, const Ray& ray, Nearest& best) {
  const std::size_t count = word & kMostListed;
  const float* list = grid.lists + static_cast<std::size_t>(word >> 8) * kListUnit;
  const Floats d[3] = {splat(ray.d[0]), splat(ray.d[1]), splat(ray.d[2])};
  const Floats r2 = splat(grid.max_radius * grid.max_radius);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const int some = count - i < kLanes ? static_cast<int>(count - i) : kLanes;
    const Floats c[3] = {load_first(list + i, some, 0.f) - ray.o[0],
                         load_first(list + count + i, some, 0.f) - ray.o[1],
                         load_first(list + 2 * count + i, some, 0.f) - ray.o[2]};
    Floats its = r2;
    if (grid.radius != nullptr) {
      its = load_first(list + 4 * count + i, some, -1.f);
    } else if (some < kLanes) {
      its = select(mask_of_first(some), r2, splat(-1));
    }
    test_lanes(
        c, d, its, grid.max_radius,
        [&](int lane) {
          std::uint32_t particle;
          __builtin_memcpy(&particle, list + 3 * count + i + lane, sizeof particle);
          return particle;
        },
        best);
    if (kAny && best.particle != kNoHit) return;
  }
}

}  // namespace firn::kernels::FIRN_ISA
