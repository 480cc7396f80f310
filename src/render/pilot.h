// SPDX-License-Identifier: MIT
// integrator = "auto": which integrator needs the least work for a picture of given error, found by rendering
// small pictures of the same view first. Work is counted, not timed, and errors come from pictures of
// different seeds, so that the choice is the same on every machine and for any number of threads. The small
// pictures are thrown away: one that looks quiet by luck is too dark, and would make the large one so.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "firn/picture.h"
#include "src/render/setup.h"

namespace firn {

// What paths cost.
struct Work {
  std::uint64_t rays = 0;   // traced
  std::uint64_t turns = 0;  // scatterings in the snow that a ray's kernel did by itself

  Work& operator+=(const Work& more) { return rays += more.rays, turns += more.turns, *this; }
  double total() const;  // in rays
};

struct Shot {
  Picture picture;
  Work work;
};
// Renders with these settings and this seed.
using Shoot = std::function<Shot(const ImageSettings& image, std::uint64_t seed)>;

struct Choice {
  Integrator integrator = Integrator::path;
  std::string why;  // empty: it was asked for
};

// Those that find all of a scene's light. The first is the one that is kept to unless another does better.
std::vector<Integrator> candidates(const RenderSetup& setup);

Choice choose_integrator(const RenderSetup& setup, const Shoot& shoot);

}  // namespace firn
