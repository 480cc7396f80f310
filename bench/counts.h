// SPDX-License-Identifier: MIT
// Work of each kernel, counted from its equations: one flop an addition, multiplication, division or square
// root, two a multiply-add. docs/kernels.md derives every number. What only watches the simulation (maxima
// for dt, the NaN check) is not counted, so a kernel that does it pays from its own share.
#pragma once

namespace firn::bench {

// A whole particle-step as the targets count it, and what a clamp by decomposition adds.
inline constexpr double kStepFlops = 1150, kClampFlops = 620;

inline constexpr double kWeightFlops = 33;    // 3 axes of 8, and nine products w_x w_y
inline constexpr double kStressFlops = 197;   // E 33, J 14, root of I + E 102, tau 26, hardening 22
inline constexpr double kScatterFlops = 387;  // affine matrix 18, corner 24, steps 48, nine rows of 33
inline constexpr double kGatherFlops = 444;   // differences of a cell / 8 18, moments 288, z 60, C, x 78
inline constexpr double kAdvanceFlops = 63;   // (I + dt C) F
inline constexpr double kYieldFlops = 97;     // E 33, two definite minors 50, J 14
inline constexpr double kSvdFlops = 1170;  // 15 rotations of 62, V made a rotation twice 140, U and order 100
inline constexpr double kGridNodeFlops = 7;  // one division, three times (multiply, add gravity)

// Bytes a particle that must be read and written when nothing stays in a cache.
inline constexpr double kP2gParticleBytes = 112;    // x v C F Jp m V0 object
inline constexpr double kG2pParticleBytes = 156;    // reads x F Jp object, writes x v C F
inline constexpr double kStressBytes = 44 + 24;     // F Jp object, six floats of tau
inline constexpr double kYieldBytes = 44 + 40;      // F Jp object, F Jp
inline constexpr double kSvdBytes = 36 + 84;        // F, U s V
inline constexpr double kSortBytes = 2 * 112 + 24;  // 28 columns read and written, twice the order, x again

}  // namespace firn::bench
