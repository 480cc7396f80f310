// SPDX-License-Identifier: MIT
// Vectors and matrices as plain arrays, so that programs of others need no library of firn's choice. World
// space is right-handed with +Y up.
#pragma once
#include <array>

namespace firn {

// x, y, z.
using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<double, 9>;  // row by row

// No rotation.
inline constexpr Matrix3 kIdentity3 = {1, 0, 0, 0, 1, 0, 0, 0, 1};

}  // namespace firn
