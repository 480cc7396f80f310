// SPDX-License-Identifier: MIT
// In-register transposes between "one column a register" and "one record a particle", by butterflies: at step
// s, rows i and i + s exchange the lanes whose index has bit s. log2(kLanes) steps, kLanes two-source
// shuffles each.
#pragma once
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

template <int kStep>
FIRN_INLINE void exchange(Floats& a, Floats& b) {
  const Floats old = a;
#if defined(__AVX512F__)
#define FIRN_LANES(E) \
  E(0), E(1), E(2), E(3), E(4), E(5), E(6), E(7), E(8), E(9), E(10), E(11), E(12), E(13), E(14), E(15)
#elif defined(__AVX2__)
#define FIRN_LANES(E) E(0), E(1), E(2), E(3), E(4), E(5), E(6), E(7)
#else
#define FIRN_LANES(E) E(0), E(1), E(2), E(3)
#endif
#define FIRN_KEEP_LOW(l) (((l)&kStep) ? kLanes + (l)-kStep : (l))
#define FIRN_KEEP_HIGH(l) (((l)&kStep) ? kLanes + (l) : (l) + kStep)
  a = __builtin_shufflevector(old, b, FIRN_LANES(FIRN_KEEP_LOW));
  b = __builtin_shufflevector(old, b, FIRN_LANES(FIRN_KEEP_HIGH));
#undef FIRN_KEEP_LOW
#undef FIRN_KEEP_HIGH
#undef FIRN_LANES
}

// Small steps first: with records of four floats, one of them unused, its rows are dead after two steps.
template <int kStep>
FIRN_INLINE void transpose_steps(Floats* rows) {
  if constexpr (kStep < kLanes) {
#pragma GCC unroll 16
    for (int i = 0; i < kLanes; ++i) {
      if ((i & kStep) == 0) exchange<kStep>(rows[i], rows[i + kStep]);
    }
    transpose_steps<2 * kStep>(rows);
  }
}

// rows[i][l] <-> rows[l][i], kLanes x kLanes.
FIRN_INLINE void transpose(Floats* rows) { transpose_steps<1>(rows); }

// Four columns -> records of four floats, within groups of four lanes: afterwards group g of rows[k] holds
// what lane 4 g + k held. A quarter of the shuffles of a full transpose; record_of_lane says where each went.
FIRN_INLINE void transpose_groups(Floats* rows) {
  exchange<2>(rows[0], rows[2]);
  exchange<2>(rows[1], rows[3]);
  exchange<1>(rows[0], rows[1]);
  exchange<1>(rows[2], rows[3]);
}

// Index of the first float of lane l's record among the 4 kLanes floats of transpose_groups.
constexpr int record_of_lane(int l) { return l % 4 * kLanes + l / 4 * 4; }

}  // namespace firn::kernels::FIRN_ISA
