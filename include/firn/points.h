// SPDX-License-Identifier: MIT
// Points of other programs, which become particles of snow: as arrays, or in files.
#pragma once
#include <string>
#include <vector>

#include "firn/export.h"
#include "firn/vector.h"

namespace firn {

// One entry a point. All but the positions may be empty, or, where it is one number a point, have one entry
// for all. Lengths are metres, or whatever the key 'scale' of the snow makes of them. How much snow a point
// is comes from the key 'spacing', else the volume, else the mass, else the radius, else from how densely the
// points lie.
struct Points {
  std::vector<Vector3> position;  // lengths
  std::vector<Vector3> velocity;  // lengths/s
  std::vector<double> volume;     // lengths^3, without strain
  std::vector<double> mass;       // kg
  std::vector<double> radius;     // lengths; half the edge of the cube that a point stands for
  std::vector<double> density;    // kg/m^3, now
  std::vector<double> Jp;         // plastic volume ratio; below 0: a layer that has collapsed
  std::vector<Matrix3> F;         // elastic deformation gradient, row by row; kept in single precision
};

// A NumPy archive or array, a PLY file, or a particle file of firn, known by its first bytes. Errors: io
// Error that names the file, and the point, counted from 0, or the array.
FIRN_API Points read_points(const std::string& file);

// As a NumPy archive (.npz), which scenes take as the 'file' of shape = "particles". Errors: usage Error as
// Scene::add_points(); io Error.
FIRN_API void write_points(const Points& points, const std::string& file);

}  // namespace firn
