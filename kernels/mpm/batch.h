// SPDX-License-Identifier: MIT
// kLanes particles of a range, one a lane. The last batch of a range is padded with inert lanes in registers,
// so a kernel has no tail loop and touches no particle of the next block.
#pragma once
#include "kernels/mpm/views.h"
#include "kernels/simd/mat3.h"

namespace firn::kernels::FIRN_ISA {

struct Batch {
  std::size_t first;
  int count;  // 1 .. kLanes
};

FIRN_INLINE Batch batch_at(const ParticleRange& range, std::size_t first) {
  const std::size_t left = range.end - first;
  return {first, left < kLanes ? static_cast<int>(left) : kLanes};
}

// Calls f with the batch at `first` and returns its count. A full batch has its count as a constant, so that
// the compiler makes one body without masks for it and one with masks for the last batch of a range.
template <class F>
FIRN_INLINE int with_batch(const ParticleRange& range, std::size_t first, F&& f) {
  const Batch b = batch_at(range, first);
  if (b.count == kLanes) [[likely]] {
    f(Batch{first, kLanes});
  } else {
    f(b);
  }
  return b.count;
}

FIRN_INLINE Floats load(const float* column, Batch b, float fill) {
  return load_first(column + b.first, b.count, fill);
}
FIRN_INLINE Vec3 load_vec3(float* const (&columns)[3], Batch b) {
  return {load(columns[0], b, 0.f), load(columns[1], b, 0.f), load(columns[2], b, 0.f)};
}
FIRN_INLINE Mat3 load_mat3(float* const (&columns)[9], Batch b, float diagonal) {
  Mat3 out;
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) out.m[i] = load(columns[i], b, i % 4 == 0 ? diagonal : 0.f);
  return out;
}
FIRN_INLINE void store_vec3(float* const (&columns)[3], Batch b, const Vec3& a) {
  store_first(columns[0] + b.first, b.count, a.x);
  store_first(columns[1] + b.first, b.count, a.y);
  store_first(columns[2] + b.first, b.count, a.z);
}
FIRN_INLINE void store_mat3(float* const (&columns)[9], Batch b, const Mat3& a) {
#pragma GCC unroll 9
  for (int i = 0; i < 9; ++i) store_first(columns[i] + b.first, b.count, a.m[i]);
}

}  // namespace firn::kernels::FIRN_ISA
