// SPDX-License-Identifier: MIT
// Snow that is made of the points of a file.
#pragma once
#include <vector>

#include "src/mpm/solver.h"
#include "src/scene/config.h"

namespace firn {

inline bool is_points(const SnowConfig& snow) { return snow.shape.shape == "particles"; }

// The points of snow number `index`, in the world, with their volumes: those of `spacing`, or else of the
// file, or else as densely as they lie. Errors: io Error at the place of `file` for one that cannot be read
// or does not fit the snow's material; usage Error where no volume can be found.
PlacedSnow place_points(const SceneConfig& scene, std::size_t index);

// An entry a body of snow: its points, or nothing for all other shapes.
std::vector<PlacedSnow> place_all_points(const SceneConfig& scene);

double points_spacing(const PlacedSnow& points);  // m; edge of the cube of a mean particle

}  // namespace firn
