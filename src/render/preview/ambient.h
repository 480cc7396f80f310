// SPDX-License-Identifier: MIT
// Light from all around, as the preview takes it: what arrives at one place in the middle of the snow from
// the sky and from the objects about it (lit by sky, suns and lamps, in their shadows), as spherical
// harmonics of order 2. Those hold what a matt surface makes of a gradient sky to 2.3 % of its mean, less
// well if light comes from a narrow cone (Ramamoorthi and Hanrahan 2001, "An efficient representation for
// irradiance environment maps"). That it is the same everywhere is the error of the one place.
#pragma once
#include <array>
#include <vector>

#include "src/render/paths/flights.h"

namespace firn {

class AmbientLight {
 public:
  // Of the sky alone.
  explicit AmbientLight(const LightSet& lights);

  // Adds what the objects do, seen from `p` (render space). For each frame.
  void look_around(const World& world, const Vec3f& p);

  // On a plane of unit normal n, from its front.
  Vec3f irradiance(const Vec3f& n) const { return irradiance_of(lobes_, n); }

 private:
  using Harmonics = std::array<Vec3f, 9>;
  using Lobes = std::array<Eigen::Array4f, 9>;  // what a cosine lobe leaves of them; the fourth is empty
  template <class Radiance>
  static Harmonics project(Radiance&& radiance);
  static Lobes lobes_of(const Harmonics& light);
  static Vec3f irradiance_of(const Lobes& light, const Vec3f& n);
  Vec3f seen(const World& world, const Vec3f& p, const Vec3f& d) const;

  Lobes sky_, lobes_;
};

}  // namespace firn
