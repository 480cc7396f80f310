// SPDX-License-Identifier: MIT
// The grain of snow below the size of a particle: a particle stands for thousands of crystals, and a smooth
// ball in its place looks like plastic. Value noise of two octaves tilts the normal. It is anchored to the
// particle (its id, its own frame), so that it travels with the snow and does not crawl.
#pragma once
#include <cstdint>

#include "src/core/vector.h"

namespace firn {

// The unit normal `smooth` with grain. `local`: from the particle's centre, in particle spacings. back: unit,
// towards the viewer: a normal that looks away from him is turned until it sees him edge on. Many at once:
// ShadeKernels::grain.
Vec3f grained(const Vec3f& smooth, const Vec3f& local, std::uint32_t id, const Vec3f& back);

}  // namespace firn
