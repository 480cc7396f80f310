// SPDX-License-Identifier: MIT
// The points of a PLY file (Turk 1994): text or binary of either byte order.
#pragma once
#include <string>
#include <string_view>

#include "src/geometry/point_cloud.h"

namespace firn {

// Of the element `vertex`: x, y, z; and, where they are there, the velocity as vx, vy, vz or velocity_x,
// velocity_y, velocity_z, and volume, mass, radius or pscale, density and Jp. Before each name may stand
// scalar_, as CloudCompare writes it. All else is passed over. `where` names the file in errors: io Error at
// a line or a byte.
PointCloud decode_ply(std::string_view bytes, const std::string& where);

}  // namespace firn
