// SPDX-License-Identifier: MIT
// How far a ray goes that nothing ends.
#pragma once
#include <limits>

namespace firn {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace firn
