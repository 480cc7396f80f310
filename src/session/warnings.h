// SPDX-License-Identifier: MIT
// What looks like a mistake in a scene: snow that floats, is buried, or that nobody sees; points of a file
// that the grid or their volume does not fit.
#pragma once
#include <vector>

#include "firn/check.h"
#include "src/mpm/solver.h"
#include "src/render/frame_tracer.h"
#include "src/scene/scene.h"

namespace firn {

// Of snow as it was placed: floating, buried and points.
std::vector<SceneWarning> warnings_of_placement(const SceneConfig& scene, const SolverSetup& setup,
                                                const RenderSetup& render);
// Of snow that is not in the picture.
std::vector<SceneWarning> warnings_of_view(const SceneConfig& scene, const Sights& sights);

}  // namespace firn
