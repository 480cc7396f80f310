// SPDX-License-Identifier: MIT
// Random numbers of many paths: the same bits as Sampler and PathRandom (src/render/sampling/sampler.h) draw
// one by one.
#include "kernels/shade/sobol.h"
#include "kernels/shade/table.h"
#include "kernels/simd/hash.h"

namespace firn::kernels::FIRN_ISA {
namespace {

// The columns of half as many draws as there are lanes; what lies beyond the end is that of the first.
struct HalfDraws {
  Longs key;
  HalfBits sample, number;

  FIRN_INLINE HalfDraws(const DrawView& draws, std::uint32_t plus, std::size_t i, std::size_t end) {
    if (end - i >= kHalfLanes) {
      key = load_half<Longs>(draws.key + i);
      sample = load_half<HalfBits>(draws.sample + i);
      number = load_half<HalfBits>(draws.number + i) + plus;
      return;
    }
    for (int l = 0; l < kHalfLanes; ++l) {
      const std::size_t at = i + l < end ? i + l : i;
      key[l] = draws.key[at];
      sample[l] = draws.sample[at];
      number[l] = draws.number[at] + plus;
    }
  }
  FIRN_INLINE Longs hash() const { return mix64(key ^ mix64(widen(number) << 32 | widen(sample))); }
};

FIRN_INLINE HalfBits low(Longs a) { return __builtin_convertvector(a & 0xffffffffull, HalfBits); }
FIRN_INLINE HalfBits high(Longs a) { return __builtin_convertvector(a >> 32, HalfBits); }
FIRN_INLINE HalfBits owen(HalfBits x, HalfBits seed) {
  return reverse_bits<HalfBits>(scramble_reversed<HalfBits>(x, seed));
}
FIRN_INLINE HalfFloats uniform(HalfBits bits) { return to_float((HalfInts)(bits >> 8)) * 0x1p-24f; }

template <class T, class V>
FIRN_INLINE void store_until(T* p, V lanes, std::size_t count) {
  __builtin_memcpy(p, &lanes, (count < kHalfLanes ? count : kHalfLanes) * sizeof(T));
}

}  // namespace

void pairs(const DrawView& draws, std::uint32_t plus, std::size_t begin, std::size_t end, float* u,
           float* v) {
  for (std::size_t i = begin; i < end; i += kHalfLanes) {
    const HalfDraws its(draws, plus, i, end);
    const Longs order = mix64(its.key ^ widen(its.number + 1) * 0x9e3779b97f4a7c15ull), digits = mix64(order);
    const HalfBits index = owen(reverse_bits<HalfBits>(its.sample), low(order));
    const HalfBits first = owen(index, low(digits));
    const HalfBits second = owen(sobol_second_reversed<HalfBits>(index), high(digits));
    const Longs hash = its.hash();
    const HalfInts ordered = (its.number & draws.within) < draws.ordered;
    store_until(u + i, uniform(ordered ? first : high(hash)), end - i);
    store_until(v + i, uniform(ordered ? second : low(hash)), end - i);
  }
}

void keys(const DrawView& draws, std::uint32_t plus, std::size_t begin, std::size_t end, std::uint64_t* key) {
  for (std::size_t i = begin; i < end; i += kHalfLanes)
    store_until(key + i, HalfDraws(draws, plus, i, end).hash(), end - i);
}

}  // namespace firn::kernels::FIRN_ISA
