// SPDX-License-Identifier: MIT
// Points of other programs: columns with one entry a point, each but the positions empty where a file has
// none. Lengths are in the file's own unit until they are placed.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "src/core/vector.h"
#include "src/geometry/point_tree.h"

namespace firn {

struct PointCloud {
  std::vector<Vec3> position;
  std::vector<Vec3> velocity;           // lengths/s
  std::vector<double> volume;           // lengths^3, without strain
  std::vector<double> mass;             // kg
  std::vector<double> radius;           // lengths; half the edge of the cube that a point stands for
  std::vector<double> density;          // kg/m^3, now
  std::vector<double> packing;          // plastic volume ratio Jp
  std::vector<Eigen::Matrix3f> strain;  // elastic deformation gradient F

  std::size_t size() const { return position.size(); }
};

// The volume that each point stands for, from how densely they lie: the median over some thousand of them.
// Within 4 % for lattices, jittered or not, and for random points; less sure where hardly any point is away
// from the surface. 0 where there are fewer than two places. A sheet or a line of points has no volume to
// find.
double volume_of_point(const PointTree& points);

}  // namespace firn
