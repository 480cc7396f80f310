// SPDX-License-Identifier: MIT
// The colour of snow is the absorption of ice: extinction is grey, so one path serves all wavelengths, and
// what it lost by wavelength depends on one number alone, the ice it crossed. IceTint turns that number into
// colour.
#pragma once
#include <functional>
#include <vector>

#include "src/core/vector.h"

namespace firn {

// Measured imaginary indices of ice. They agree from 600 nm on; at 450 nm Picard's is 7 times Warren and
// Brandt's, which is how uncertain the blue of snow is.
enum class IceSource {
  picard,         // Picard, Libois, Arnaud 2016, The Cryosphere 10, 2655: natural snow, Antarctica
  warren_brandt,  // Warren, Brandt 2008, J. Geophys. Res. 113, D14220: the cleanest snow and ice
};

// 4 pi k / lambda, 1/m. Wavelengths are taken within 400 to 700 nm.
double ice_absorption(IceSource data, double wavelength_nm);

inline constexpr double kIceDensity = 917;  // kg/m^3

// How much longer the way of light inside a grain is than the grain's mean chord: B of Libois et al. 2014
// (J. Glaciol. 60, 714), who measured 0.7 to 2.4 in natural snow, mostly 1.4 to 1.8. Spheres have 1.3 by
// Mie's sums.
inline constexpr double kNaturalEnhancement = 1.6, kSphereEnhancement = 1.3;
// Mean cosine of scattering that goes with them.
inline constexpr double kNaturalAnisotropy = 0.845, kSphereAnisotropy = 0.89;

// sigma_t / density, m^2/kg, for the optical (surface-weighted) grain radius in m; extinction efficiency 2.
constexpr double snow_extinction(double grain_radius) { return 3 / (2 * kIceDensity * grain_radius); }

// m of ice that a path crosses per collision, in the mean: half of all collisions are diffraction beside the
// grain, the others cross B chords of 4/3 radius. exp(-absorption * it) is the albedo of a collision.
constexpr double ice_per_collision(double grain_radius, double enhancement = kNaturalEnhancement) {
  return enhancement * 2 / 3 * grain_radius;
}

// Linear sRGB of white light (D65) of which each wavelength keeps kept(absorption by ice, 1/m).
Vec3 color_of(IceSource data, const std::function<double(double)>& kept);

// Linear sRGB of white light (D65) after a way through ice, m, summed over the wavelengths by the colour
// matching functions of CIE 1931; 1, 1, 1 at 0. A pure deep blue lies outside sRGB, so red falls below 0, to
// -0.12 at 20 m, and blue may exceed 1 by 0.02. That is kept: pixels are sums over paths, and cut off path by
// path they would come out too red. For the same reason tints do not multiply: ask once, for all the ice of a
// path.
Vec3 ice_color(IceSource data, double ice_path);

// The same from a table, to 5e-5; ways below 0 count as 0.
class IceTint {
 public:
  explicit IceTint(IceSource data);
  Vec3f operator()(float ice_path) const;

 private:
  std::vector<Vec3f> table_;
};

}  // namespace firn
