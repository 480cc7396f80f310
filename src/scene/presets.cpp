// SPDX-License-Identifier: MIT
// Where the numbers come from: `fresh` is the default snow of Stomakhin et al. 2013 (SIGGRAPH, table of
// parameters). The others move its parameters the way its section 6 describes (low critical compression and
// stretch: powder that crumbles; high ones: chunky, coherent snow; high stiffness and hardening: icy), with
// densities of the ranges in Paterson 1994, "The Physics of Glaciers", table 2.1. The amounts by which they
// move are choices of this project.
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

}  // namespace

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"fresh", Material{}, "soft snow that packs and breaks", "Stomakhin et al. 2013, default parameters"},
      {"powder", snow({120, 4.8e4, 1.5e-2, 4e-3, 7}), "light, dry, crumbles at once",
       "low limits after Stomakhin et al. 2013, section 6; new snow after Paterson 1994"},
      {"packed", snow({380, 3e5, 2.5e-2, 7.5e-3, 10}), "wind-packed or pressed, breaks into slabs",
       "fresh, stiffer; wind-packed snow after Paterson 1994"},
      {"wet", snow({500, 1e5, 4e-2, 1.2e-2, 8}), "heavy, sticks, holds together in chunks",
       "high limits after Stomakhin et al. 2013, section 6; settled wet snow after Paterson 1994"},
      {"ice_crust", snow({750, 1.5e6, 2e-2, 5e-3, 15}), "hard and brittle",
       "high stiffness and hardening after Stomakhin et al. 2013, section 6; very wet snow and firn after "
       "Paterson 1994"},
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
