// SPDX-License-Identifier: MIT
// What a collision in the snow does to light, worked out once for each snow object from its SnowLook.
#pragma once
#include <algorithm>
#include <vector>

#include "src/core/portable_math.h"
#include "src/render/setup.h"
#include "src/render/snow/snow_layer.h"

namespace firn {

struct SnowGrain {
  float g = 0;                   // mean cosine of a scattering; 0 in deep cells (SnowField::medium)
  float ice = 0;                 // m of ice that light crosses
  Vec3f albedo = Vec3f::Ones();  // what is left besides the ice's own absorption: dirt, sand
  Vec3f layer = Vec3f::Ones();   // reflectance of a deep layer, all in all

  bool operator==(const SnowGrain& other) const {
    return g == other.g && ice == other.ice && albedo == other.albedo;
  }
};

// Albedo of an isotropic collision in a deep medium whose reflectance is R: the fit of Chiang, Kutz, Burley
// 2016 ("Practical and controllable subsurface scattering for production path tracing"; from memory). It ends
// at 0.9989; a reflectance of 1 is taken as white.
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

// Reflectance of a layer without end: exp(-y) (snow_layer.h).
inline Vec3f layer_reflectance(const SnowLook& look, IceSource ice) {
  const Vec3 y = layer_exponent(look, ice);
  Vec3f reflectance;
  for (int c = 0; c < 3; ++c) reflectance[c] = static_cast<float>(portable_exp(-y[c])) * look.albedo[c];
  return reflectance;
}

class SnowGrains {
 public:
  SnowGrains(std::vector<SnowLook> looks, IceSource ice) {
    if (looks.empty()) looks.emplace_back();
    for (const SnowLook& look : looks) {
      grains_.push_back(snow_grain(look, false));
      deep_.push_back(snow_grain(look, true));
      grains_.back().layer = layer_reflectance(look, ice);
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
