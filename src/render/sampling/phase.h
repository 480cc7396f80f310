// SPDX-License-Identifier: MIT
// Scattering inside a medium: Henyey and Greenstein 1941, with mean cosine g; 0 is isotropic. Densities are
// per solid angle; they are the phase function itself, so a sampled direction carries no weight.
#pragma once
#include <cmath>

#include "src/render/sampling/directions.h"

namespace firn {

// `cosine`: between the directions of travel before and after.
inline float phase_density(float g, float cosine) {
  const float base = 1 + g * g - 2 * g * cosine;
  return (1 - g * g) / (4 * kPi * base * std::sqrt(base));
}

// `along`: the direction of travel before.
inline Vec3f phase_direction(float g, const Vec3f& along, Sample2 at) {
  float cosine = 1 - 2 * at.u;
  if (std::fabs(g) > 1e-3f) {
    const float part = (1 - g * g) / (1 + g - 2 * g * at.u);
    cosine = std::fmin(std::fmax((1 + g * g - part * part) / (2 * g), -1.f), 1.f);
  }
  const Disc disc = on_circle(std::sqrt(std::fmax(1 - cosine * cosine, 0.f)), at.v);
  return around(along, disc.x, disc.y, cosine).normalized();
}

}  // namespace firn
