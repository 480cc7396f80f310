// SPDX-License-Identifier: MIT
// One [[snow]] as particles, and what is refused before and after.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "src/scene/emit.h"
#include "src/scene/place_shape.h"
#include "src/scene/scene.h"

namespace firn {

// shapes: those of place_snow(); spacing in m. Errors: usage Error if not one particle fits in.
PlacedSnow place_particles(const SceneConfig& scene, std::size_t index, const std::vector<Shape>& shapes,
                           double spacing);

// Loosens the seams between clumps, beside what the packing was.
void loosen(const SceneConfig& scene, std::size_t index, PlacedSnow& snow);

// Before any is placed in shapes, points of files being there already: a scene that is far too fine would
// take all memory, and for ever. One entry a snow. Errors: usage Error for more than this machine has memory
// for.
void check_count(const SceneConfig& scene, const std::vector<PlacedSnow>& points,
                 const std::vector<std::vector<Shape>>& shapes, const std::vector<double>& spacing,
                 double dx);

// Takes out the particles whose entry in `marked` is not 0.
void leave_out(PlacedSnow& snow, const std::vector<unsigned char>& marked);

// Errors: usage Error if elastic waves in this snow are too fast for any step.
void check_waves(const SceneConfig& scene, std::size_t index, double dx);

// Errors: usage Error if a particle lies outside.
void check_domain(const SceneConfig& scene, std::size_t index, const PlacedSnow& snow,
                  const std::optional<Shape>& domain);

}  // namespace firn
