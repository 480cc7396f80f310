// SPDX-License-Identifier: MIT
// Lanes: one register of floats, as wide as the instruction set of this build (4, 8 or 16), with GNU vector
// arithmetic (a * b + c, -a, a / b) and the few operations that it lacks. A lane never sees its neighbours,
// so a kernel written with these gives the same bits at 8 and at 16 lanes; `base` has no fused multiply-add
// and promises only its own. Masks are mask registers on AVX-512 and integer vectors elsewhere, hidden behind
// one type.
#pragma once
#include <immintrin.h>

#include <cstdint>

#define FIRN_INLINE __attribute__((always_inline)) inline
#define FIRN_INLINE_LAMBDA __attribute__((always_inline))

namespace firn::kernels::FIRN_ISA {

#if defined(__AVX512F__)
inline constexpr int kLanes = 16;
#elif defined(__AVX2__)
inline constexpr int kLanes = 8;
#else
inline constexpr int kLanes = 4;
#endif

typedef float Floats __attribute__((vector_size(4 * kLanes)));
typedef std::int32_t Ints __attribute__((vector_size(4 * kLanes)));

#if defined(__AVX512F__)

struct Mask {
  __mmask16 bits;
};
FIRN_INLINE Mask operator&(Mask a, Mask b) { return {static_cast<__mmask16>(a.bits & b.bits)}; }
FIRN_INLINE Mask operator|(Mask a, Mask b) { return {static_cast<__mmask16>(a.bits | b.bits)}; }
FIRN_INLINE Mask operator!(Mask a) { return {static_cast<__mmask16>(~a.bits)}; }
FIRN_INLINE Mask less(Floats a, Floats b) { return {_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ)}; }
FIRN_INLINE Mask less_equal(Floats a, Floats b) { return {_mm512_cmp_ps_mask(a, b, _CMP_LE_OQ)}; }
FIRN_INLINE Mask equal(Ints a, Ints b) { return {_mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b)}; }
FIRN_INLINE Mask less(Ints a, Ints b) { return {_mm512_cmplt_epi32_mask((__m512i)a, (__m512i)b)}; }
FIRN_INLINE Floats select(Mask m, Floats yes, Floats no) { return _mm512_mask_blend_ps(m.bits, no, yes); }
FIRN_INLINE int lane_bits(Mask m) { return m.bits; }
FIRN_INLINE Floats splat(float s) { return _mm512_set1_ps(s); }
FIRN_INLINE Ints splat_int(std::int32_t s) { return (Ints)_mm512_set1_epi32(s); }
FIRN_INLINE Floats load(const float* p) { return _mm512_loadu_ps(p); }
FIRN_INLINE Ints load(const std::int32_t* p) { return (Ints)_mm512_loadu_si512(p); }
FIRN_INLINE void store(float* p, Floats a) { _mm512_storeu_ps(p, a); }
FIRN_INLINE void store(std::int32_t* p, Ints a) { _mm512_storeu_si512(p, (__m512i)a); }
FIRN_INLINE Floats fma(Floats a, Floats b, Floats c) { return _mm512_fmadd_ps(a, b, c); }
FIRN_INLINE Floats sqrt(Floats a) { return _mm512_sqrt_ps(a); }
FIRN_INLINE Floats min(Floats a, Floats b) { return _mm512_min_ps(a, b); }
FIRN_INLINE Floats max(Floats a, Floats b) { return _mm512_max_ps(a, b); }
FIRN_INLINE Ints round_to_int(Floats a) { return (Ints)_mm512_cvtps_epi32(a); }  // to nearest, ties to even
FIRN_INLINE Floats to_float(Ints a) { return _mm512_cvtepi32_ps((__m512i)a); }
// The four floats at p, repeated in every group of four lanes.
FIRN_INLINE Floats load_repeated4(const float* p) { return _mm512_broadcast_f32x4(_mm_loadu_ps(p)); }

#elif defined(__AVX2__)

struct Mask {
  Ints bits;  // all ones or all zeros a lane
};
FIRN_INLINE Mask operator&(Mask a, Mask b) { return {a.bits & b.bits}; }
FIRN_INLINE Mask operator|(Mask a, Mask b) { return {a.bits | b.bits}; }
FIRN_INLINE Mask operator!(Mask a) { return {~a.bits}; }
FIRN_INLINE Mask less(Floats a, Floats b) { return {a < b}; }
FIRN_INLINE Mask less_equal(Floats a, Floats b) { return {a <= b}; }
FIRN_INLINE Mask equal(Ints a, Ints b) { return {a == b}; }
FIRN_INLINE Mask less(Ints a, Ints b) { return {a < b}; }
FIRN_INLINE Floats select(Mask m, Floats yes, Floats no) { return _mm256_blendv_ps(no, yes, (__m256)m.bits); }
FIRN_INLINE int lane_bits(Mask m) { return _mm256_movemask_ps((__m256)m.bits); }
FIRN_INLINE Floats splat(float s) { return _mm256_set1_ps(s); }
FIRN_INLINE Ints splat_int(std::int32_t s) { return (Ints)_mm256_set1_epi32(s); }
FIRN_INLINE Floats load(const float* p) { return _mm256_loadu_ps(p); }
FIRN_INLINE Ints load(const std::int32_t* p) {
  return (Ints)_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}
FIRN_INLINE void store(float* p, Floats a) { _mm256_storeu_ps(p, a); }
FIRN_INLINE void store(std::int32_t* p, Ints a) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), (__m256i)a);
}
FIRN_INLINE Floats fma(Floats a, Floats b, Floats c) { return _mm256_fmadd_ps(a, b, c); }
FIRN_INLINE Floats sqrt(Floats a) { return _mm256_sqrt_ps(a); }
FIRN_INLINE Floats min(Floats a, Floats b) { return _mm256_min_ps(a, b); }
FIRN_INLINE Floats max(Floats a, Floats b) { return _mm256_max_ps(a, b); }
FIRN_INLINE Ints round_to_int(Floats a) { return (Ints)_mm256_cvtps_epi32(a); }
FIRN_INLINE Floats to_float(Ints a) { return _mm256_cvtepi32_ps((__m256i)a); }
FIRN_INLINE Floats load_repeated4(const float* p) {
  return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p));
}

#else

struct Mask {
  Ints bits;
};
FIRN_INLINE Mask operator&(Mask a, Mask b) { return {a.bits & b.bits}; }
FIRN_INLINE Mask operator|(Mask a, Mask b) { return {a.bits | b.bits}; }
FIRN_INLINE Mask operator!(Mask a) { return {~a.bits}; }
FIRN_INLINE Mask less(Floats a, Floats b) { return {a < b}; }
FIRN_INLINE Mask less_equal(Floats a, Floats b) { return {a <= b}; }
FIRN_INLINE Mask equal(Ints a, Ints b) { return {a == b}; }
FIRN_INLINE Mask less(Ints a, Ints b) { return {a < b}; }
FIRN_INLINE Floats select(Mask m, Floats yes, Floats no) {
  return (Floats)((m.bits & (Ints)yes) | (~m.bits & (Ints)no));
}
FIRN_INLINE int lane_bits(Mask m) { return _mm_movemask_ps((__m128)m.bits); }
FIRN_INLINE Floats splat(float s) { return _mm_set1_ps(s); }
FIRN_INLINE Ints splat_int(std::int32_t s) { return (Ints)_mm_set1_epi32(s); }
FIRN_INLINE Floats load(const float* p) { return _mm_loadu_ps(p); }
FIRN_INLINE Ints load(const std::int32_t* p) {
  return (Ints)_mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
}
FIRN_INLINE void store(float* p, Floats a) { _mm_storeu_ps(p, a); }
FIRN_INLINE void store(std::int32_t* p, Ints a) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(p), (__m128i)a);
}
FIRN_INLINE Floats fma(Floats a, Floats b, Floats c) { return a * b + c; }
FIRN_INLINE Floats sqrt(Floats a) { return _mm_sqrt_ps(a); }
FIRN_INLINE Floats min(Floats a, Floats b) { return _mm_min_ps(a, b); }
FIRN_INLINE Floats max(Floats a, Floats b) { return _mm_max_ps(a, b); }
FIRN_INLINE Ints round_to_int(Floats a) { return (Ints)_mm_cvtps_epi32(a); }
FIRN_INLINE Floats to_float(Ints a) { return _mm_cvtepi32_ps((__m128i)a); }
FIRN_INLINE Floats load_repeated4(const float* p) { return _mm_loadu_ps(p); }

#endif

inline constexpr int kAllLanes = (1 << kLanes) - 1;

FIRN_INLINE bool any(Mask m) { return lane_bits(m) != 0; }
FIRN_INLINE bool all(Mask m) { return lane_bits(m) == kAllLanes; }
FIRN_INLINE Floats abs(Floats a) { return (Floats)((Ints)a & 0x7fffffff); }
FIRN_INLINE Floats copy_sign(Floats size, Floats sign) {
  return (Floats)(((Ints)size & 0x7fffffff) | ((Ints)sign & splat_int(INT32_MIN)));
}
FIRN_INLINE Floats square(Floats a) { return a * a; }

// Wraps around instead of overflowing: in a simulation that has blown up, before the step's check finds it.
FIRN_INLINE Ints wrapping_add(Ints a, Ints b) {
  typedef std::uint32_t Bits __attribute__((vector_size(4 * kLanes)));
  return (Ints)((Bits)a + (Bits)b);
}

// The first `count` lanes from p, the others `fill`: the last batch of a range reads nothing that is not its
// own.
FIRN_INLINE Floats load_first(const float* p, int count, float fill) {
  if (count >= kLanes) return load(p);
  float lanes[kLanes];
  for (int i = 0; i < kLanes; ++i) lanes[i] = fill;
  for (int i = 0; i < count; ++i) lanes[i] = p[i];
  return load(lanes);
}
FIRN_INLINE Ints load_first(const std::int32_t* p, int count, std::int32_t fill) {
  if (count >= kLanes) return load(p);
  std::int32_t lanes[kLanes];
  for (int i = 0; i < kLanes; ++i) lanes[i] = fill;
  for (int i = 0; i < count; ++i) lanes[i] = p[i];
  return load(lanes);
}
template <class T, class V>
FIRN_INLINE void store_first(T* p, int count, V a) {
  if (count >= kLanes) {
    store(p, a);
    return;
  }
  T lanes[kLanes];
  store(lanes, a);
  for (int i = 0; i < count; ++i) p[i] = lanes[i];
}

FIRN_INLINE float largest_lane(Floats a) {
  float lanes[kLanes];
  store(lanes, a);
  float m = lanes[0];
  for (int i = 1; i < kLanes; ++i) m = lanes[i] > m ? lanes[i] : m;
  return m;
}

}  // namespace firn::kernels::FIRN_ISA
