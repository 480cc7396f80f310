// SPDX-License-Identifier: MIT
// From shape keys to Shapes in the world.
#pragma once
#include <cstdint>
#include <vector>

#include "src/geometry/keyframes.h"
#include "src/geometry/shape.h"
#include "src/scene/config.h"

namespace firn {

enum class ShapeUse {
  snow,
  solid
};  // what a height field ends in below: 0, or deep enough to hold everything up

// One Shape for everything but flakes. Errors: those of load_obj and load_height_raster, at the place of
// `file`.
Shape place_shape(const SceneConfig& scene, const std::string& table, const ShapeConfig& config,
                  ShapeUse use);

// Shapes of snow [[snow]] number `index`: one, or every flake. `gap` (m) is left between flakes. Errors: as
// place_shape; usage Error when the flakes do not fit into their region.
std::vector<Shape> place_snow(const SceneConfig& scene, std::size_t index, double gap);

// How a collider moves that was placed at `shape`.
Motion place_motion(const ColliderConfig& config, const Shape& shape);

Mat3 rotation_matrix(const Vec3& degrees);  // about x, then y, then z
Shape plane_shape(const Vec3& point, const Vec3& normal);

}  // namespace firn
