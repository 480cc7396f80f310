// SPDX-License-Identifier: MIT
// Snow that comes into a simulation while it is under way.
#pragma once
#include <vector>

#include "firn/snapshot.h"
#include "src/scene/scene.h"

namespace firn {

// What is there already.
struct Surroundings {
  const Snapshot& snow;
  const std::vector<Collider>& colliders;  // each with its shape where it is now
  const std::optional<Shape>& domain;
  double dx;  // m
};

// Snow [[snow]] number `index`, placed as at the start of a scene. With `trim` it is left out where it lies
// within a particle's spacing of other snow or inside a collider. Errors: those of build_simulation(); usage
// Error for snow within half a spacing of other snow, deeper than that inside a collider (but for
// `allow_overlap`), or outside the domain.
PlacedSnow place_among(const SceneConfig& scene, std::size_t index, const Surroundings& surroundings);

}  // namespace firn
