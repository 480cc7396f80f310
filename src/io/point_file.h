// SPDX-License-Identifier: MIT
// Points of a file, whatever its format: known by its first bytes, not by its name.
#pragma once
#include <string>
#include <string_view>

#include "src/geometry/point_cloud.h"

namespace firn {

// A NumPy archive or array, a PLY file, or a particle file of firn. There is at least one point; everything
// is finite, volumes, masses, radii, densities and det F are above 0, Jp is not 0. `where` names the file in
// errors: io Error that names the point, counted from 0, or what is read instead.
PointCloud decode_points(std::string_view bytes, const std::string& where);
PointCloud read_point_file(const std::string& path);

// Errors: io Error at `where` for a cloud that breaks what is said above.
void require_sound(const PointCloud& cloud, const std::string& where);

}  // namespace firn
