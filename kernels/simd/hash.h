// SPDX-License-Identifier: MIT
// Hashes of 64 bits in lanes: half as many as there are floats, with floats and integers to go with them.
// The same bits as mix64 of src/core/rng.h.
#pragma once
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr int kHalfLanes = kLanes / 2;
typedef std::uint64_t Longs __attribute__((vector_size(8 * kHalfLanes)));
typedef std::int64_t HalfLongs __attribute__((vector_size(8 * kHalfLanes)));
typedef std::uint32_t HalfBits __attribute__((vector_size(4 * kHalfLanes)));
typedef std::int32_t HalfInts __attribute__((vector_size(4 * kHalfLanes)));
typedef float HalfFloats __attribute__((vector_size(4 * kHalfLanes)));

// The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
FIRN_INLINE Longs mix64(Longs z) {
  z += 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

template <class V, class T>
FIRN_INLINE V load_half(const T* p) {
  V lanes;
  __builtin_memcpy(&lanes, p, sizeof lanes);
  return lanes;
}
FIRN_INLINE Longs widen(HalfBits a) { return __builtin_convertvector(a, Longs); }
FIRN_INLINE HalfFloats to_float(HalfInts a) { return __builtin_convertvector(a, HalfFloats); }
// `count` bits from `shift` on, as a whole number.
FIRN_INLINE HalfFloats bits_to_float(Longs bits, int shift, std::uint64_t mask) {
  return to_float((HalfInts) __builtin_convertvector(bits >> shift & mask, HalfBits));
}
FIRN_INLINE HalfLongs long_lane_numbers() {
  HalfLongs lanes;
#pragma GCC unroll 8
  for (int l = 0; l < kHalfLanes; ++l) lanes[l] = l;
  return lanes;
}
// Bit l is set where lane l of a comparison is true.
FIRN_INLINE int long_lane_bits(HalfLongs a) {
#if defined(__AVX512F__)
  return _mm512_movepi64_mask((__m512i)a);
#elif defined(__AVX2__)
  return _mm256_movemask_pd((__m256d)a);
#else
  return _mm_movemask_pd((__m128d)a);
#endif
}
FIRN_INLINE HalfInts floor_to_int(HalfFloats a) {
  const HalfInts towards_zero = __builtin_convertvector(a, HalfInts);
  return towards_zero + (a < to_float(towards_zero));
}

}  // namespace firn::kernels::FIRN_ISA
