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
typedef std::uint32_t Bits __attribute__((vector_size(4 * kLanes)));  // arithmetic wraps around

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
// p[index] of the lanes in m, 0 in the others.
FIRN_INLINE Ints gather(const std::int32_t* p, Ints index, Mask m) {
  return (Ints)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m.bits, (__m512i)index, p, 4);
}
// The four floats at p, repeated in every group of four lanes.
FIRN_INLINE Floats load_repeated4(const float* p) { return _mm512_broadcast_f32x4(_mm_loadu_ps(p)); }
// Part `part` of the sixteen floats in which each of the four floats at p stands four times.
FIRN_INLINE Floats load_spread4(const float* p, int) {
  const __m512i each = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  return _mm512_permutexvar_ps(each, _mm512_castps128_ps512(_mm_loadu_ps(p)));
}
FIRN_INLINE Floats replace_last4(Floats a, Floats by) { return _mm512_mask_blend_ps(0xf000, a, by); }
FIRN_INLINE Mask all_lanes() { return {0xffff}; }
// Stores the lanes in `m` one after another from p on; what follows, up to kLanes in all, may be overwritten.
FIRN_INLINE void store_packed(float* p, Mask m, Floats a) {
  _mm512_storeu_ps(p, _mm512_maskz_compress_ps(m.bits, a));
}
FIRN_INLINE void store_packed(std::int32_t* p, Mask m, Ints a) {
  _mm512_storeu_si512(p, _mm512_maskz_compress_epi32(m.bits, (__m512i)a));
}
FIRN_INLINE __mmask16 first_lanes(int count) { return static_cast<__mmask16>((1u << count) - 1); }
FIRN_INLINE Mask mask_of_first(int count) { return {first_lanes(count)}; }
FIRN_INLINE Floats load_some(const float* p, int count, float fill) {
  return _mm512_mask_loadu_ps(splat(fill), first_lanes(count), p);
}
FIRN_INLINE Ints load_some(const std::int32_t* p, int count, std::int32_t fill) {
  return (Ints)_mm512_mask_loadu_epi32((__m512i)splat_int(fill), first_lanes(count), p);
}
FIRN_INLINE void store_some(float* p, int count, Floats a) {
  _mm512_mask_storeu_ps(p, first_lanes(count), a);
}
FIRN_INLINE void store_some(std::int32_t* p, int count, Ints a) {
  _mm512_mask_storeu_epi32(p, first_lanes(count), (__m512i)a);
}

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
FIRN_INLINE Ints gather(const std::int32_t* p, Ints index, Mask m) {
  return (Ints)_mm256_mask_i32gather_epi32(_mm256_setzero_si256(), p, (__m256i)index, (__m256i)m.bits, 4);
}
FIRN_INLINE Floats load_repeated4(const float* p) {
  return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p));
}
FIRN_INLINE Floats load_spread4(const float* p, int part) {
  const __m256i low = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
  const __m256i high = _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3);
  return _mm256_permutevar8x32_ps(_mm256_castps128_ps256(_mm_loadu_ps(p)), part == 0 ? low : high);
}
FIRN_INLINE Floats replace_last4(Floats a, Floats by) { return _mm256_blend_ps(a, by, 0xf0); }
FIRN_INLINE Mask all_lanes() { return {splat_int(-1)}; }

// For each mask of eight lanes, which lanes stand in it, one after another.
struct PackOrders {
  alignas(32) std::int32_t of[256][8];
};
constexpr PackOrders pack_orders() {
  PackOrders orders{};
  for (int bits = 0; bits < 256; ++bits) {
    int n = 0;
    for (int lane = 0; lane < 8; ++lane) {
      if (bits >> lane & 1) orders.of[bits][n++] = lane;
    }
  }
  return orders;
}
inline constexpr PackOrders kPackOrders = pack_orders();

FIRN_INLINE void store_packed(float* p, Mask m, Floats a) {
  store(p, _mm256_permutevar8x32_ps(a, (__m256i)load(kPackOrders.of[lane_bits(m)])));
}
FIRN_INLINE void store_packed(std::int32_t* p, Mask m, Ints a) {
  store(reinterpret_cast<float*>(p),
        _mm256_permutevar8x32_ps((__m256)a, (__m256i)load(kPackOrders.of[lane_bits(m)])));
}
FIRN_INLINE __m256i first_lanes(int count) {
  return _mm256_cmpgt_epi32(_mm256_set1_epi32(count), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}
FIRN_INLINE Mask mask_of_first(int count) { return {(Ints)first_lanes(count)}; }
FIRN_INLINE Floats load_some(const float* p, int count, float fill) {
  const __m256i mask = first_lanes(count);
  return _mm256_blendv_ps(splat(fill), _mm256_maskload_ps(p, mask), (__m256)mask);
}
FIRN_INLINE Ints load_some(const std::int32_t* p, int count, std::int32_t fill) {
  const __m256i mask = first_lanes(count);
  return (Ints)_mm256_blendv_epi8((__m256i)splat_int(fill), _mm256_maskload_epi32(p, mask), mask);
}
FIRN_INLINE void store_some(float* p, int count, Floats a) { _mm256_maskstore_ps(p, first_lanes(count), a); }
FIRN_INLINE void store_some(std::int32_t* p, int count, Ints a) {
  _mm256_maskstore_epi32(p, first_lanes(count), (__m256i)a);
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
typedef double Doubles __attribute__((vector_size(8 * kLanes)));
FIRN_INLINE Doubles widen(Floats a) { return __builtin_convertvector(a, Doubles); }
FIRN_INLINE Floats fma_in_full(Floats a, Floats b, Floats c) {
  return __builtin_convertvector(widen(a) * widen(b) + widen(c), Floats);
}
FIRN_INLINE Floats sqrt(Floats a) { return _mm_sqrt_ps(a); }
FIRN_INLINE Floats min(Floats a, Floats b) { return _mm_min_ps(a, b); }
FIRN_INLINE Floats max(Floats a, Floats b) { return _mm_max_ps(a, b); }
FIRN_INLINE Ints round_to_int(Floats a) { return (Ints)_mm_cvtps_epi32(a); }
FIRN_INLINE Floats to_float(Ints a) { return _mm_cvtepi32_ps((__m128i)a); }
FIRN_INLINE Ints gather(const std::int32_t* p, Ints index, Mask m) {
  Ints lanes;
  for (int l = 0; l < kLanes; ++l) lanes[l] = m.bits[l] ? p[index[l]] : 0;
  return lanes;
}
FIRN_INLINE Floats load_repeated4(const float* p) { return _mm_loadu_ps(p); }
FIRN_INLINE Floats load_spread4(const float* p, int part) { return _mm_set1_ps(p[part]); }
template <class V, class T>
FIRN_INLINE V load_lane_by_lane(const T* p, int count, T fill) {
  V lanes;
  for (int i = 0; i < kLanes; ++i) lanes[i] = i < count ? p[i] : fill;
  return lanes;
}
FIRN_INLINE Floats load_some(const float* p, int count, float fill) {
  return load_lane_by_lane<Floats>(p, count, fill);
}
FIRN_INLINE Ints load_some(const std::int32_t* p, int count, std::int32_t fill) {
  return load_lane_by_lane<Ints>(p, count, fill);
}
template <class T, class V>
FIRN_INLINE void store_some(T* p, int count, V a) {
  for (int i = 0; i < count; ++i) p[i] = a[i];
}
FIRN_INLINE Floats replace_last4(Floats, Floats by) { return by; }
FIRN_INLINE Mask all_lanes() { return {splat_int(-1)}; }
template <class T, class V>
FIRN_INLINE void store_packed(T* p, Mask m, V a) {
  for (int i = 0; i < kLanes; ++i) {
    if (m.bits[i]) *p++ = a[i];
  }
}
FIRN_INLINE Mask mask_of_first(int count) { return {splat_int(count) > Ints{0, 1, 2, 3}}; }

#endif

inline constexpr int kAllLanes = (1 << kLanes) - 1;

#if defined(__AVX2__)
// a * b + c without rounding a * b first, on every instruction set.
FIRN_INLINE Floats fma_in_full(Floats a, Floats b, Floats c) { return fma(a, b, c); }
#endif

FIRN_INLINE Ints lane_numbers() {
  Ints lanes;
#pragma GCC unroll 16
  for (int l = 0; l < kLanes; ++l) lanes[l] = l;
  return lanes;
}

// Lane l of the result is lane from[l] of `a`, counted modulo the number of lanes. GCC has an operator for
// it. For clang the vectors whose order is known only at run time are named one by one; it sees through the
// loop where the order is a constant.
template <class V, class Order>
FIRN_INLINE V permute(V a, Order from) {
#if !defined(__clang__)
  return __builtin_shuffle(a, from);
#else
#if defined(__AVX2__)
  if constexpr (sizeof(V) == 32 && sizeof(a[0]) == 4) {
    return (V)_mm256_permutevar8x32_ps((__m256)a, (__m256i)from);
  }
#endif
#if defined(__AVX512F__)
  if constexpr (sizeof(V) == 64 && sizeof(a[0]) == 8) {
    return (V)_mm512_permutexvar_epi64((__m512i)from, (__m512i)a);
  }
#endif
  constexpr int kCount = sizeof(V) / sizeof(a[0]);
  V lanes;
#pragma GCC unroll 16
  for (int l = 0; l < kCount; ++l) lanes[l] = a[from[l] & (kCount - 1)];
  return lanes;
#endif
}

FIRN_INLINE Mask mask_of_bits(int bits) {  // lane l where bit l is set
  return equal((splat_int(bits) >> lane_numbers()) & 1, splat_int(1));
}
// As for integers.
FIRN_INLINE Floats gather(const float* p, Ints index, Mask m) {
  return (Floats)gather(reinterpret_cast<const std::int32_t*>(p), index, m);
}
FIRN_INLINE bool any(Mask m) { return lane_bits(m) != 0; }
FIRN_INLINE bool all(Mask m) { return lane_bits(m) == kAllLanes; }
FIRN_INLINE Ints select(Mask m, Ints yes, Ints no) { return (Ints)select(m, (Floats)yes, (Floats)no); }
FIRN_INLINE Ints min(Ints a, Ints b) { return a < b ? a : b; }
FIRN_INLINE Ints max(Ints a, Ints b) { return a > b ? a : b; }
FIRN_INLINE Floats abs(Floats a) { return (Floats)((Ints)a & 0x7fffffff); }
FIRN_INLINE Floats copy_sign(Floats size, Floats sign) {
  return (Floats)(((Ints)size & 0x7fffffff) | ((Ints)sign & splat_int(INT32_MIN)));
}
FIRN_INLINE Floats square(Floats a) { return a * a; }

// Wraps around instead of overflowing: in a simulation that has blown up, before the step's check finds it.
FIRN_INLINE Ints wrapping_add(Ints a, Ints b) { return (Ints)((Bits)a + (Bits)b); }

// The first `count` lanes from p, the others `fill`: the last batch of a range reads nothing that is not its
// own. Masked moves are slow on some machines, and only the last batch of a range needs them.
template <class T>
FIRN_INLINE auto load_first(const T* p, int count, T fill) {
  return count >= kLanes ? load(p) : load_some(p, count, fill);
}
template <class T, class V>
FIRN_INLINE void store_first(T* p, int count, V a) {
  if (count >= kLanes) {
    store(p, a);
  } else {
    store_some(p, count, a);
  }
}

FIRN_INLINE float largest_lane(Floats a) {
  float lanes[kLanes];
  store(lanes, a);
  float m = lanes[0];
  for (int i = 1; i < kLanes; ++i) m = lanes[i] > m ? lanes[i] : m;
  return m;
}

// The same where no lane is NaN, in few steps.
FIRN_INLINE float greatest_lane(Floats a) {
#pragma GCC unroll 4
  for (int half = kLanes / 2; half > 0; half /= 2) a = max(a, permute(a, lane_numbers() ^ half));
  return a[0];
}

// The greatest lane of each of kLanes registers, in the lane of its number. Overwrites them.
FIRN_INLINE Floats greatest_of_each(Floats (&a)[kLanes]) {
#pragma GCC unroll 4
  for (int half = kLanes / 2; half > 0; half /= 2) {
    const Mask upper = equal(lane_numbers() & half, splat_int(half));
    const Ints other = lane_numbers() ^ half;
#pragma GCC unroll 8
    for (int i = 0; i < half; ++i) {
      // Lanes without this bit are of register i, those with it of register i + half.
      const Floats kept = select(upper, a[i + half], a[i]), moved = select(upper, a[i], a[i + half]);
      a[i] = max(kept, permute(moved, other));
    }
  }
  return a[0];
}

}  // namespace firn::kernels::FIRN_ISA
