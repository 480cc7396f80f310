// SPDX-License-Identifier: MIT
// Named snows. Each is a whole Material with the source of its numbers.
#pragma once
#include <string>
#include <vector>

#include "src/mpm/material.h"

namespace firn {

struct Preset {
  const char* name;
  Material material;
  double grain_radius;  // m, optical
  const char* meaning;
  const char* source;
};

const std::vector<Preset>& presets();
const Preset& find_preset(const std::string& name);  // precondition: one of preset_names()
std::vector<std::string> preset_names();

}  // namespace firn
