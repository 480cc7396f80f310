// SPDX-License-Identifier: MIT
#include "tests/light/photons.h"

#include "tests/light/pictures.h"

namespace firn::test {

Medium slab(double albedo, double g, double tau) {
  Medium medium;
  medium.shape = floor_plane(0);
  const bool thick = std::isinf(tau);
  const double sigma = thick ? 1 : tau;
  if (!thick) medium.thickness = 1;
  medium.sigma_s = Vec3f::Constant(static_cast<float>(sigma * albedo));
  medium.sigma_a = Vec3f::Constant(static_cast<float>(sigma * (1 - albedo)));
  medium.g = static_cast<float>(g);
  return medium;
}

}  // namespace firn::test
