// SPDX-License-Identifier: MIT
// Work of each kernel, counted from its equations: one flop an addition, multiplication, division or square
// root, two a multiply-add. docs/kernels.md derives every number. What only watches the simulation (maxima
// for dt, the NaN check) is not counted, so a kernel that does it pays from its own share.
#pragma once

namespace firn::bench {

// A whole particle-step as the targets count it, and what a clamp by decomposition adds.
inline constexpr double kStepFlops = 1150, kClampFlops = 620;

inline constexpr double kWeightFlops = 33;
inline constexpr double kStressFlops = 179;
inline constexpr double kScatterFlops = 387;
inline constexpr double kGatherWeightFlops = 28;
inline constexpr double kGatherFlops = 354;
inline constexpr double kAdvanceFlops = 63;
inline constexpr double kYieldFlops = 97;
inline constexpr double kSvdFlops = 330;
inline constexpr double kGridNodeFlops = 7;

// Bytes a unit that must be read and written when nothing stays in a cache; of tiles and nodes, which depend
// on how full the blocks are, kernels.cpp knows more.
inline constexpr double kP2gBytes = 108;    // reads x v C F Jp m object
inline constexpr double kG2pBytes = 152;    // reads x F Jp object, writes x v C F
inline constexpr double kStressBytes = 68;  // reads F Jp object, writes six floats
inline constexpr double kYieldBytes = 84;   // reads F Jp object, writes F Jp
inline constexpr double kSvdBytes = 120;    // reads F, writes U s V
inline constexpr double kSortBytes = 252;   // moves 28 columns, writes and reads two orders, reads x
inline constexpr double kGridNodeBytes = 32;

}  // namespace firn::bench
