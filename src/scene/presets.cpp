// SPDX-License-Identifier: MIT
// Where the numbers come from: `fresh` is the default snow of Stomakhin et al. 2013, "A material point method
// for snow simulation". The others move its parameters in the directions that its section 6 describes: high
// critical compression and stretch make coherent chunks, high stiffness and hardening make it icy. How far
// they move, and the densities, are round numbers chosen by this project in the usual range of each kind of
// snow. Grains follow the model of Klar et al. 2016; their numbers are chosen by this project.
//
// Powder and the weak layer under a slab are cohesive Cam-Clay. Powder bears 50 Pa of tension, the weight of
// 4 cm of it, crushes under 500 Pa and rests at 38 degrees: with the low limits that Stomakhin et al. advise
// for powder it would keep its width, whatever presses it, and lose its volume instead of running to a heap.
//
// The weak layer follows Gaume et al. 2018, "Dynamic anticrack propagation in snow": it softens however it
// yields, loses its cohesion and closes by 5 %. A slab lays little pressure on it and much shear, and at the
// pressure of the ellipse's centre, p0 (1 - beta) / 2, shear neither softens nor hardens; the pressure must
// stay below that until cohesion is gone, hence a low beta. What is left after failure is friction of 27
// degrees, less than the 35 to 40 of slopes that slide. p0 and xi are such that 0.8 m of `dry_slab` stands on
// 38 degrees, also when its weight comes on at once, and lets go when it is broken at one spot by a weight
// (tests/physics/test_slab.cpp). A layer so strong is not near failure under the slab at rest, and a mere cut
// makes no crack run through it: that needs a third of p0 and slow loading (tests/physics/test_saw.cpp).
// 1 MPa keeps the slab's base whole under that load. It is soft: slabs of 250 kg/m^3 have 5 MPa in saw tests
// (van Herwijnen et al. 2016, J. Glaciol. 62: 0.93 rho^2.8 Pa), 20 to 70 MPa by other methods
// (docs/physics.md).
//
// Grains, by their optical radius: 20 to 100 um in new snow, 100 to 300 um in fine-grained older snow, 1
// to 1.5 mm in snow that melts (Wiscombe, Warren 1980, J. Atmos. Sci. 37, 2712); within these chosen by this
// project.
#include "src/scene/presets.h"

#include <cassert>

namespace firn {
namespace {

struct Change {
  double density, young_modulus, critical_compression, critical_stretch, hardening;
};

Material snow(const Change& change) {
  Material material;
  material.density = change.density;
  material.young_modulus = change.young_modulus;
  material.critical_compression = change.critical_compression;
  material.critical_stretch = change.critical_stretch;
  material.hardening = change.hardening;
  return material;
}

struct Grains {
  double density, young_modulus, poisson_ratio, friction_angle, cohesion;
};

Material grains(const Grains& of) {
  Material material;
  material.model = kKindOf<kernels::DruckerPrager>;
  material.density = of.density;
  material.young_modulus = of.young_modulus;
  material.poisson_ratio = of.poisson_ratio;
  material.friction_angle = of.friction_angle;
  material.cohesion = of.cohesion;
  return material;
}

struct Clay {
  double density, young_modulus, poisson_ratio, friction_angle, compressive_strength, cohesion_ratio,
      hardening, collapse = 0;
};

Material clay(const Clay& of) {
  Material material;
  material.model = kKindOf<kernels::CamClay>;
  material.density = of.density;
  material.young_modulus = of.young_modulus;
  material.poisson_ratio = of.poisson_ratio;
  material.friction_angle = of.friction_angle;
  material.compressive_strength = of.compressive_strength;
  material.cohesion_ratio = of.cohesion_ratio;
  material.hardening = of.hardening;
  material.collapse = of.collapse;
  return material;
}

}  // namespace

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"fresh", Material{}, 1e-4, "soft snow that packs and breaks",
       "Stomakhin et al. 2013, default parameters"},
      {"powder", clay({120, 5e4, 0.2, 38, 500, 0.1, 0.3}), 8e-5, "light, dry, crumbles at once",
       "model of Gaume et al. 2018; fresh snow has 70 to 150 kg/m^3 (AMS Glossary of Meteorology); the rest "
       "chosen by this project"},
      {"packed", snow({380, 3e5, 2.5e-2, 7.5e-3, 10}), 2.5e-4, "wind-packed or pressed, breaks into slabs",
       "fresh, stiffened; chosen by this project"},
      {"wet", snow({500, 1e5, 4e-2, 1.2e-2, 8}), 7e-4, "heavy, sticks, holds together in chunks",
       "higher limits (Stomakhin et al. 2013, section 6); density chosen by this project"},
      {"ice_crust", snow({750, 1.5e6, 2e-2, 5e-3, 15}), 1e-3, "hard and brittle",
       "higher stiffness and hardening (Stomakhin et al. 2013, section 6); density chosen by this project"},
      {"dry_slab", snow({250, 1e6, 2e-2, 4e-3, 10}), 2e-4,
       "wind slab: stiff for its weight, breaks into blocks",
       "packed, lighter, stiffer and more brittle; chosen by this project"},
      {"weak_layer", clay({150, 1e6, 0.3, 27, 3e4, 0.1, 3, 0.05}), 4e-4,
       "buried loose grains under a slab: once broken they close and only rub",
       "model of Gaume et al. 2018; numbers chosen by this project"},
      {"sand", grains({1600, 3.5e5, 0.3, 30, 0}), 2.5e-4, "dry grains, rest at a slope",
       "model of Klar et al. 2016, stiffness of its order; density of loose quartz sand and angle chosen by "
       "this project"},
  };
  return all;
}

const Preset& find_preset(const std::string& name) {
  for (const Preset& preset : presets()) {
    if (preset.name == name) return preset;
  }
  assert(false && "the schema lets only known presets pass");
  return presets().front();
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const Preset& preset : presets()) names.emplace_back(preset.name);
  return names;
}

}  // namespace firn
