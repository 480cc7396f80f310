// SPDX-License-Identifier: MIT
// What is traced: balls of equal radius on a jittered lattice of spacing 1 m, seen by one camera and lit by
// one point light.
//
//   ball   a ball of snow that fills the picture's height
//   slab   a dune field: ripples and one hill, seen from above at a slant
#pragma once
#include <cstddef>
#include <string>

#include "firn/snapshot.h"
#include "src/core/vector.h"

namespace firn::bench {

struct TraceScene {
  Snapshot snapshot;           // lengths in m, one lattice spacing being 1 m; dx is 2
  Vec3 camera, center, light;  // m, world; the camera looks at `center`, +Y is up
};

inline constexpr int kFilmWidth = 1024, kFilmHeight = 768;  // pixels
inline constexpr double kViewAngle = 40;                    // degrees, vertical

// About `particles` of them. `order` is "lattice" (x fastest) or "blocks": as the simulation hands them over,
// by blocks of 4^3 cells of dx and by cell in them. Errors: usage, for an unknown name.
TraceScene trace_scene(const std::string& shape, const std::string& order, std::size_t particles);

}  // namespace firn::bench
