// SPDX-License-Identifier: MIT
// The least snow that has all that a saved simulation holds: some dozen particles, a collider with forces,
// one step.
#pragma once
#include "src/core/isa.h"
#include "src/mpm/solver.h"
#include "src/scene/scene.h"

namespace firn::fuzz {

inline const char* const kTinyScene = R"(
[camera]
position = [0.0, 0.3, 1.0]
target = [0.0, 0.1, 0.0]
[simulation]
particles_across = 4
[[snow]]
shape = "ball"
center = [0.0, 0.04, 0.0]
radius = 0.05
preset = "fresh"
[ground]
friction = 0.5
)";

inline Solver tiny_snow() {
  Solver snow(choose_kernels("base"), build_simulation(read_scene_text(kTinyScene, "tiny.toml", {})));
  snow.step(1e-5);
  return snow;
}

}  // namespace firn::fuzz
