// SPDX-License-Identifier: MIT
// Compiled once per instruction set, as the kernels are.
#include "bench/brick_test.h"

#include "kernels/simd/lanes.h"

namespace firn::bench::FIRN_ISA {

namespace {

using namespace kernels::FIRN_ISA;

constexpr float kOccluded = -__builtin_inff();

struct Brick {
  const float *x, *y, *z, *r2;
  int count;
};

FIRN_INLINE Brick brick_at(const void* user, unsigned brick) {
  const auto& balls = *static_cast<const BrickBalls*>(user);
  const std::size_t begin = balls.start[brick], count = balls.start[brick + 1] - begin;
  const float* x = balls.ball + 4 * begin;
  return {x, x + count, x + 2 * count, x + 3 * count, static_cast<int>(count)};
}

// Columns of rays [first, first + count) of a packet of `size`, as Embree lays them out.
struct Rays {
  float *origin[3], *direction[3], *reach;
  int count;
};

FIRN_INLINE Rays rays_of(RTCRayN* packet, unsigned size, unsigned first) {
  float* at = reinterpret_cast<float*>(packet) + first;
  return {{at, at + size, at + 2 * size},
          {at + 4 * size, at + 5 * size, at + 6 * size},
          at + 8 * size,
          size - first < kLanes ? static_cast<int>(size - first) : kLanes};
}

// r^2 - |q|^2, q being the ball's centre seen from the ray; negative for a miss. `along` is to the point
// nearest to the centre.
FIRN_INLINE Floats project(const Floats c[3], const Floats d[3], Floats r2, Floats& along) {
  along = fma(c[2], d[2], fma(c[1], d[1], c[0] * d[0]));
  const Floats qx = fma(-along, d[0], c[0]), qy = fma(-along, d[1], c[1]), qz = fma(-along, d[2], c[2]);
  return r2 - fma(qz, qz, fma(qy, qy, qx * qx));
}

// One ray against a register of balls at a time: the nearest that it enters within `reach`, or -1. Loads run
// over the brick's end, where their lanes do not count.
template <bool kAny>
FIRN_INLINE int test_ray(const Brick& brick, const Rays& rays, int lane, float& reach) {
  const float o[3] = {rays.origin[0][lane], rays.origin[1][lane], rays.origin[2][lane]};
  const Floats d[3] = {splat(rays.direction[0][lane]), splat(rays.direction[1][lane]),
                       splat(rays.direction[2][lane])};
  int nearest = -1;
  for (int b = 0; b < brick.count; b += kLanes) {
    const int rest = brick.count - b, own = rest < kLanes ? (1 << rest) - 1 : kAllLanes;
    const Floats c[3] = {load(brick.x + b) - o[0], load(brick.y + b) - o[1], load(brick.z + b) - o[2]};
    Floats along;
    const Floats depth2 = project(c, d, load(brick.r2 + b), along);
    if ((lane_bits(less_equal(splat(0), depth2)) & own) == 0) continue;
    const Floats t = along - sqrt(depth2);
    int hits = lane_bits(less(splat(0), t) & less(t, splat(reach))) & own;
    if (hits == 0) continue;
    if (kAny) return b;
    float distance[kLanes];
    store(distance, t);
    for (; hits != 0; hits &= hits - 1) {
      const int ball = __builtin_ctz(static_cast<unsigned>(hits));
      if (distance[ball] >= reach) continue;
      reach = distance[ball];
      nearest = b + ball;
    }
  }
  return nearest;
}

// A register of rays against one ball at a time. `found` gets the number of the nearest ball of each ray or
// -1, the result its distance. Rays that are not in `active` find nothing.
template <bool kAny>
FIRN_INLINE Floats test_packet(const Brick& brick, const Rays& rays, Mask active, Ints& found) {
  const auto column = [&](const float* p) FIRN_INLINE_LAMBDA { return load_first(p, rays.count, 0.f); };
  const Floats o[3] = {column(rays.origin[0]), column(rays.origin[1]), column(rays.origin[2])};
  const Floats d[3] = {column(rays.direction[0]), column(rays.direction[1]), column(rays.direction[2])};
  Floats reach = select(active, column(rays.reach), splat(-1));
  found = splat_int(-1);
  for (int b = 0; b < brick.count; ++b) {
    const Floats c[3] = {brick.x[b] - o[0], brick.y[b] - o[1], brick.z[b] - o[2]};
    Floats along;
    const Floats depth2 = project(c, d, splat(brick.r2[b]), along);
    if (!any(less_equal(splat(0), depth2))) continue;
    const Floats t = along - sqrt(depth2);
    const Mask nearer = less(splat(0), t) & less(t, reach);
    reach = select(nearer, kAny ? splat(-1) : t, reach);
    found = (Ints)select(nearer, (Floats)splat_int(b), (Floats)found);
    if (kAny && !any(less(splat(0), reach))) break;
  }
  return reach;
}

// Whether so few rays are left that balls fill a register better than rays do.
FIRN_INLINE bool few(int rays, int balls) { return 2 * rays * ((balls + kLanes - 1) / kLanes) <= balls; }

FIRN_INLINE Mask active_lanes(const int* valid, int count) {
  return less(load_first(valid, count, 0), splat_int(0));
}

void intersect(const RTCIntersectFunctionNArguments* args) {
  const Brick brick = brick_at(args->geometryUserPtr, args->primID);
  auto* hits = reinterpret_cast<unsigned*>(RTCRayHitN_HitN(args->rayhit, args->N));
  for (unsigned first = 0; first < args->N; first += kLanes) {
    const Rays rays = rays_of(RTCRayHitN_RayN(args->rayhit, args->N), args->N, first);
    unsigned *primitive = hits + 5 * args->N + first, *geometry = hits + 6 * args->N + first;
    const auto put = [&](int lane, float t, int ball) {
      rays.reach[lane] = t;
      primitive[lane] = args->primID << kBrickBallBits | static_cast<unsigned>(ball);
      geometry[lane] = args->geomID;
    };
    const Mask active = args->N == 1 ? mask_of_first(1) : active_lanes(args->valid + first, rays.count);
    int lanes = lane_bits(active);
    if (few(__builtin_popcount(static_cast<unsigned>(lanes)), brick.count)) {
      for (; lanes != 0; lanes &= lanes - 1) {
        const int lane = __builtin_ctz(static_cast<unsigned>(lanes));
        float reach = rays.reach[lane];
        if (const int ball = test_ray<false>(brick, rays, lane, reach); ball >= 0) put(lane, reach, ball);
      }
      continue;
    }
    Ints ball;
    float distance[kLanes];
    store(distance, test_packet<false>(brick, rays, active, ball));
    for (int met = lane_bits(less(splat_int(-1), ball)); met != 0; met &= met - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(met));
      put(lane, distance[lane], ball[lane]);
    }
  }
}

void occluded(const RTCOccludedFunctionNArguments* args) {
  const Brick brick = brick_at(args->geometryUserPtr, args->primID);
  for (unsigned first = 0; first < args->N; first += kLanes) {
    const Rays rays = rays_of(args->ray, args->N, first);
    const Mask active = args->N == 1 ? mask_of_first(1) : active_lanes(args->valid + first, rays.count);
    int lanes = lane_bits(active);
    if (few(__builtin_popcount(static_cast<unsigned>(lanes)), brick.count)) {
      for (; lanes != 0; lanes &= lanes - 1) {
        const int lane = __builtin_ctz(static_cast<unsigned>(lanes));
        float reach = rays.reach[lane];
        if (test_ray<true>(brick, rays, lane, reach) >= 0) rays.reach[lane] = kOccluded;
      }
      continue;
    }
    Ints ball;
    test_packet<true>(brick, rays, active, ball);
    for (int met = lane_bits(less(splat_int(-1), ball)); met != 0; met &= met - 1) {
      rays.reach[__builtin_ctz(static_cast<unsigned>(met))] = kOccluded;
    }
  }
}

void bounds(const RTCBoundsFunctionArguments* args) {
  const Brick brick = brick_at(args->geometryUserPtr, args->primID);
  constexpr float kFar = 3e38f;
  Floats low[3] = {splat(kFar), splat(kFar), splat(kFar)},
         high[3] = {splat(-kFar), splat(-kFar), splat(-kFar)};
  for (int b = 0; b < brick.count; b += kLanes) {
    const Mask own = mask_of_first(brick.count - b < kLanes ? brick.count - b : kLanes);
    const Floats c[3] = {load(brick.x + b), load(brick.y + b), load(brick.z + b)};
    const Floats r = sqrt(load(brick.r2 + b));
    for (int a = 0; a < 3; ++a) {
      low[a] = select(own, min(low[a], c[a] - r), low[a]);
      high[a] = select(own, max(high[a], c[a] + r), high[a]);
    }
  }
  *args->bounds_o = {-largest_lane(-low[0]), -largest_lane(-low[1]), -largest_lane(-low[2]), 0,
                     largest_lane(high[0]),  largest_lane(high[1]),  largest_lane(high[2]),  0};
}

}  // namespace

BrickCallbacks brick_callbacks() { return {bounds, intersect, occluded}; }

}  // namespace firn::bench::FIRN_ISA
