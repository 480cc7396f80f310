// SPDX-License-Identifier: MIT
// Snow that starts inside other snow or inside colliders.
#pragma once
#include <vector>

#include "src/scene/scene.h"

namespace firn {

// Takes from snow with `trim` the particles that lie inside a collider, or inside snow that is not trimmed or
// stands before it in the file. Then, but for snow with `allow_overlap`, nothing may lie deeper than half a
// particle's spacing inside another body. shapes, spacing (m): of each snow of the setup. Errors: usage Error
// that names all overlaps, or snow of which nothing is left.
void settle_overlaps(const SceneConfig& scene, SolverSetup& setup,
                     const std::vector<std::vector<Shape>>& shapes, const std::vector<double>& spacing);

}  // namespace firn
