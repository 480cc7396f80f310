// SPDX-License-Identifier: MIT
// Rays against the balls of one brick, in registers: what Embree calls for a primitive that is a brick.
// Packets of rays meet one ball after another; a single ray, or few left of a packet, meets a register of
// balls.
#pragma once
#include <cstdint>

#include "bench/rtcore.h"

namespace firn::bench {

// Balls sorted by brick, as the callbacks read them (their geometryUserPtr). Brick b has balls
// [start[b], start[b + 1]), n of them: n x, n y, n z (m) and n squared radii (m^2) from ball[4 * start[b]]
// on.
struct BrickBalls {
  const std::uint32_t* start;
  const float* ball;
};

// A hit's primID: the brick and the ball's number in it.
inline constexpr unsigned kBrickBallBits = 8;

struct BrickCallbacks {
  RTCBoundsFunction bounds;
  RTCIntersectFunctionN intersect;
  RTCOccludedFunctionN occluded;
};

namespace isa_base {
BrickCallbacks brick_callbacks();
}
namespace isa_v3 {
BrickCallbacks brick_callbacks();
}
namespace isa_v4 {
BrickCallbacks brick_callbacks();
}

}  // namespace firn::bench
