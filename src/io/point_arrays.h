// SPDX-License-Identifier: MIT
// Points as arrays of a program.
#pragma once
#include <string>

#include "firn/points.h"
#include "src/geometry/point_cloud.h"

namespace firn {

// Checked as the points of a file are. Errors: usage Error at `where` for columns of another length than the
// positions, and for values that no point may have.
PointCloud cloud_of(const Points& points, const std::string& where);

}  // namespace firn
