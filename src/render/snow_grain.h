// SPDX-License-Identifier: MIT
// What a collision in the snow does to light, worked out once for each snow object from its SnowLook.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "src/core/portable_math.h"
#include "src/render/setup.h"

namespace firn {

struct SnowGrain {
  float g = 0;                   // mean cosine of a scattering; 0 in deep cells (SnowField::medium)
  float ice = 0;                 // m of ice that light crosses
  Vec3f albedo = Vec3f::Ones();  // what is left besides the ice's own absorption: dirt, sand

  bool operator==(const SnowGrain& other) const {
    return g == other.g && ice == other.ice && albedo == other.albedo;
  }
};

// Albedo of an isotropic collision in a deep medium whose reflectance is R: the fit of Christensen and Burley
// 2015 (Pixar Technical Memo 15-04), exact at R = 1.
inline double collision_albedo(double reflectance) {
  const double r = reflectance;
  if (r >= 1) return 1;
  return 1 - portable_exp(-5.09406 * r + 2.61188 * r * r - 4.31805 * r * r * r);
}

// One collision in a deep cell stands for 1 / (1 - g) true ones.
inline SnowGrain snow_grain(const SnowLook& look, bool deep) {
  const double many = 1 / (1 - look.anisotropy);
  SnowGrain grain;
  grain.g = deep ? 0.f : static_cast<float>(look.anisotropy);
  grain.ice = static_cast<float>(look.ice_per_collision * (deep ? many : 1));
  for (int c = 0; c < 3; ++c) {
    const double isotropic = collision_albedo(look.albedo[c]);
    grain.albedo[c] = static_cast<float>(deep ? isotropic : portable_pow(isotropic, 1 / many));
  }
  return grain;
}

class SnowGrains {
 public:
  explicit SnowGrains(std::vector<SnowLook> looks) {
    if (looks.empty()) looks.emplace_back();
    for (const SnowLook& look : looks) {
      grains_.push_back(snow_grain(look, false));
      deep_.push_back(snow_grain(look, true));
      alike_ = alike_ && grains_.back() == grains_.front();
    }
  }
  bool alike() const { return alike_; }
  const SnowGrain& of(std::size_t object, bool deep) const {
    return (deep ? deep_ : grains_)[std::min(object, grains_.size() - 1)];
  }

 private:
  std::vector<SnowGrain> grains_, deep_;
  bool alike_ = true;
};

}  // namespace firn
