// SPDX-License-Identifier: MIT
#include "src/core/rotation.h"

#include <Eigen/LU>
#include <cmath>

namespace firn {
namespace {

// q and -q are one rotation: the real part is made >= 0.
struct Quaternion {
  double w;
  Vec3 v;
};

// From the largest of its four parts (Shepperd 1978, J. Guidance and Control 1, 223).
Quaternion to_quaternion(const Mat3& r) {
  const double parts[4] = {r.trace(), r(0, 0), r(1, 1), r(2, 2)};
  int largest = 0;
  for (int k = 1; k < 4; ++k) {
    if (parts[k] > parts[largest]) largest = k;
  }
  const Vec3 odd(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
  Quaternion q{1 + parts[0], odd};
  if (largest > 0) {
    const int i = largest - 1, j = (i + 1) % 3, k = (i + 2) % 3;
    q.w = odd[i];
    q.v[i] = 1 + r(i, i) - r(j, j) - r(k, k);
    q.v[j] = r(j, i) + r(i, j);
    q.v[k] = r(k, i) + r(i, k);
  }
  const double scale = (q.w < 0 ? -1 : 1) / std::sqrt(q.w * q.w + q.v.squaredNorm());
  return {q.w * scale, q.v * scale};
}

}  // namespace

// Newton's iteration for the orthogonal factor, scaled (Higham 1986, SIAM J. Sci. Stat. Comput. 7, 1160).
Mat3 polar_rotation(const Mat3& f) {
  Mat3 r = f;
  for (int round = 0; round < 20; ++round) {
    const double det = r.determinant();
    if (!(det > 1e-12) || !std::isfinite(det)) return Mat3::Identity();
    const Mat3 other = r.inverse().transpose();
    const double scale = std::sqrt(other.norm() / r.norm());
    const Mat3 next = 0.5 * (scale * r + other / scale);
    const double change = (next - r).norm();
    r = next;
    if (change < 1e-4) break;  // squared by the next step
  }
  return 0.5 * (r + Mat3(r.inverse().transpose()));
}

PackedRotation pack_rotation(const Mat3& rotation) {
  const Quaternion q = to_quaternion(rotation);
  const Vec3 parameters = q.v / (1 + q.w) * 32767;
  PackedRotation packed;
  for (int a = 0; a < 3; ++a) packed[a] = static_cast<std::int16_t>(std::floor(parameters[a] + 0.5));
  return packed;
}

Eigen::Matrix3f unpack_rotation(const PackedRotation& packed) {
  const Vec3f p = Vec3f(packed[0], packed[1], packed[2]) * (1 / 32767.f);
  const float p2 = p.squaredNorm();
  Eigen::Matrix3f cross;
  cross << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  return Eigen::Matrix3f::Identity() + (8 * cross * cross + 4 * (1 - p2) * cross) / ((1 + p2) * (1 + p2));
}

}  // namespace firn
