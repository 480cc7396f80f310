// SPDX-License-Identifier: MIT
// A clear day's sky: Preetham, Shirley, Smits 1999, "A practical analytic model for daylight": Perez's five
// coefficients for luminance and chromaticity, linear in the turbidity, and the zenith's values.
#pragma once
#include <array>

#include "src/render/setup.h"

namespace firn {

class DaySky {
 public:
  explicit DaySky(const DaySkyLight& light);

  Vec3f radiance(const Vec3f& d) const;  // from the unit direction d

 private:
  struct Perez {
    std::array<double, 5> a;
    double zenith;  // over its own value there
    double at(double cos_zenith, double sun_angle, double cos_sun) const;
  };

  Vec3f above(const Vec3& d) const;

  Vec3 sun_;
  Perez luminance_, x_, y_;  // kcd/m^2; CIE 1931 chromaticity
  double scale_;
  Vec3f ground_;
};

}  // namespace firn
