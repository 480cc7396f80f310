// SPDX-License-Identifier: MIT
// Whether directions are drawn with the density that is claimed for them.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "src/core/vector.h"
#include "src/render/sampling/sampler.h"

namespace firn::test {

// Independent random numbers.
Sample2 random_pair(std::uint64_t seed, std::uint64_t index, std::uint64_t which);

// Directions within a cone about `axis` whose 1 - cos(half angle) is `spread` (2: all), in cells of equal
// solid angle.
struct Cone {
  Vec3f axis = Vec3f::UnitY();
  float spread = 2;
};

// Draws `count` directions; a zero vector stands for none. Returns how far the sum of squares lies from that
// of a fair count in the cells, in standard deviations (normal by Wilson and Hilferty 1931). Directions
// outside the cone and draws without one make one more cell, which has the rest of the density.
double chi_squared_z(const std::function<Vec3f(std::uint64_t)>& draw, std::uint64_t count,
                     const std::function<double(const Vec3f&)>& density, const Cone& cone = {});

// Integral over the cone, by the middles of many cells.
double integrate(const std::function<double(const Vec3f&)>& f, const Cone& cone = {}, int side = 1000);

}  // namespace firn::test
