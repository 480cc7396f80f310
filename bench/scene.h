// SPDX-License-Identifier: MIT
// The snow that is measured: 8 particles a cell, dx = 1/128 m, Stomakhin snow with plasticity, a floor with
// friction.
//
//   impact   a ball two cells above the floor, thrown at it with 10 m/s: rigid at first, then it breaks and
//            packs
//   falling  the same ball, too high to reach the floor
//   settled  a packed block that lies on the floor (jittered within its 8 particles a cell), at rest but for
//            its own weight
#pragma once
#include <cstddef>
#include <string>

#include "src/mpm/solver.h"

namespace firn::bench {

inline constexpr double kSceneDx = 1.0 / 128;  // m

// About this many particles. Errors: usage, for an unknown name.
SolverSetup bench_scene(const std::string& name, std::size_t particles);

// m/s; no particle of the scene can be faster than twice this unless the simulation has blown up.
double scene_speed(const SolverSetup& setup);

}  // namespace firn::bench
