// SPDX-License-Identifier: MIT
// What one core can do at most, in loops of this instruction set's own lanes. Compiled once per instruction
// set, as the kernels are.
#include <cstddef>

#include "kernels/simd/lanes.h"

namespace firn::bench::FIRN_ISA {

using namespace kernels::FIRN_ISA;

// Multiply-adds in independent chains; returns the flops done. `sink` has room for one register.
double multiply_add(long rounds, float* sink) {
  constexpr int kChains = 12;  // enough to hide the latency, few enough for sixteen registers
  Floats chain[kChains];
  const Floats scale = splat(0.999f), add = splat(1e-3f);
#pragma GCC unroll 12
  for (int c = 0; c < kChains; ++c) chain[c] = splat(static_cast<float>(c));
  for (long round = 0; round < rounds; ++round) {
#pragma GCC unroll 12
    for (int c = 0; c < kChains; ++c) chain[c] = fma(chain[c], scale, add);
  }
  Floats sum = splat(0.f);
#pragma GCC unroll 12
  for (int c = 0; c < kChains; ++c) sum = sum + chain[c];
  store(sink, sum);
  return 2.0 * kChains * kLanes * static_cast<double>(rounds);
}

// Reads and writes every float once; returns bytes moved. `count` is a multiple of kLanes.
double scale_in_place(float* at, std::size_t count) {
  const Floats scale = splat(0.999f);
  for (std::size_t i = 0; i < count; i += kLanes) store(at + i, load(at + i) * scale);
  return 8.0 * static_cast<double>(count);
}

}  // namespace firn::bench::FIRN_ISA
