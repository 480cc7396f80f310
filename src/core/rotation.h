// SPDX-License-Identifier: MIT
// Rotations: how far a deformed body is turned, and a rotation in six bytes.
#pragma once
#include <array>
#include <cstdint>

#include "src/core/vector.h"

namespace firn {

// R of the polar decomposition F = R S, to 1e-7. Identity where det F is not above 0 or not finite: no
// rotation is near such an F. No libm: the same bits on every machine.
Mat3 polar_rotation(const Mat3& f);

// The axis times tan(angle / 4) (modified Rodrigues parameters), each in steps of 1/32767; all 0 is no
// rotation. As exact at any angle: to 1.1e-4 rad.
using PackedRotation = std::array<std::int16_t, 3>;
PackedRotation pack_rotation(const Mat3& rotation);
Eigen::Matrix3f unpack_rotation(const PackedRotation& packed);

}  // namespace firn
