// SPDX-License-Identifier: MIT
// 16 float lanes and their masks.
#pragma once
#include <cstdint>
#include <cstring>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace firn::kernels::FIRN_ISA {

using F16 = float __attribute__((vector_size(64)));
using I16 = std::int32_t __attribute__((vector_size(64)));

inline F16 load16(const float* p) {
  F16 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline F16 splat16(float v) { return F16{} + v; }
inline F16 sqrt16(F16 v) {
#if defined(__AVX512F__)
  return (F16)_mm512_sqrt_ps((__m512)v);
#else
  for (int i = 0; i < 16; ++i) v[i] = __builtin_sqrtf(v[i]);
  return v;
#endif
}
// Bit i is set where mask lane i is -1.
inline unsigned bits16(I16 mask) {
#if defined(__AVX512F__)
  return _mm512_movepi32_mask((__m512i)mask);
#elif defined(__AVX2__)
  __m256 half[2];
  std::memcpy(half, &mask, sizeof half);
  return static_cast<unsigned>(_mm256_movemask_ps(half[0])) |
         static_cast<unsigned>(_mm256_movemask_ps(half[1])) << 8;
#else
  unsigned bits = 0;
  for (int i = 0; i < 16; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
#endif
}

}  // namespace firn::kernels::FIRN_ISA
