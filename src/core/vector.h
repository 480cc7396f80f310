// SPDX-License-Identifier: MIT
// The vector types of src/: double for setting up the world, float for light. Kernels know none of these.
#pragma once
#include <Eigen/Core>
#include <array>

#include "firn/vector.h"

namespace firn {

using Vec3 = Eigen::Vector3d;  // metres, m/s, ...; world space, right-handed, +Y up
using Mat3 = Eigen::Matrix3d;
using Vec3f = Eigen::Vector3f;  // render space (metres from the render origin) or linear RGB

// To and from the public types.
inline Vec3 vec(const Vector3& v) { return {v[0], v[1], v[2]}; }
inline Vector3 array_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Mat3 mat(const Matrix3& rows) { return Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(rows.data()); }
inline Matrix3 rows_of(const Mat3& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

// Of linear RGB: Rec. 709.
template <class Rgb>
auto luminance_of(const Rgb& rgb) {
  using T = typename Rgb::Scalar;
  return T(0.2126) * rgb[0] + T(0.7152) * rgb[1] + T(0.0722) * rgb[2];
}

// An axis-aligned box; empty while min > max in any axis.
struct Bounds {
  Vec3 min = Vec3::Constant(1e300);
  Vec3 max = Vec3::Constant(-1e300);

  bool empty() const { return (min.array() > max.array()).any(); }
  void include(const Vec3& p) {
    min = min.cwiseMin(p);
    max = max.cwiseMax(p);
  }
  void include(const Bounds& b) {
    min = min.cwiseMin(b.min);
    max = max.cwiseMax(b.max);
  }
  Vec3 size() const { return empty() ? Vec3::Zero() : Vec3(max - min); }
  Vec3 center() const { return 0.5 * (min + max); }
};

}  // namespace firn
