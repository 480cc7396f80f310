// SPDX-License-Identifier: MIT
// Collects a BlockSummary over batches: maxima in lanes, flags in masks, NaN caught by comparisons that it
// fails.
#pragma once
#include "kernels/mpm/stretch.h"
#include "kernels/mpm/views.h"

namespace firn::kernels::FIRN_ISA {

class Summary {
 public:
  FIRN_INLINE void add_position(Ints x, Ints y, Ints z) {
    lowest_ = min(lowest_, min(x, min(y, z)));
    highest_ = max(highest_, max(x, max(y, z)));
  }

  // The inert lanes of a batch stand still with F = I: they raise no maximum that a particle does not.
  FIRN_INLINE void add_motion(const Vec3& v, const Mat3& c, const Deformation& d, Floats jp, Floats wave2) {
    const Floats v2 = dot(v, v), c2 = norm2(c);
    speed2_ = max(speed2_, v2);
    rate2_ = max(rate2_, c2);
    wave2_ = max(wave2_, wave2);
    // Squares overflow beyond 1e19: no such speed, rate or stretch is a simulation's.
    const Floats everything = (v2 + c2) + (trace(d.e) + abs(jp));
    finite_ = finite_ & less(everything, splat(3e38f));
  }

  FIRN_INLINE void add_wave_speed(Floats wave2) { wave2_ = max(wave2_, wave2); }

  FIRN_INLINE void add_clamped(Mask changed, int count) {
    clamped_ += __builtin_popcount(static_cast<unsigned>(lane_bits(changed) & ((1 << count) - 1)));
  }

  // J. Each particle's is rounded by itself.
  FIRN_INLINE void add_plastic_work(double work, double quanta) {
    const double most = 0x1p52, counted = work * quanta;
    const double bounded = counted < most ? (counted > -most ? counted : -most) : most;  // a NaN too
    plastic_work_ += _mm_cvtsd_si64(_mm_set_sd(bounded));
  }

  FIRN_INLINE void write(BlockSummary& out) const {
    out = {
        largest_lane(speed2_), largest_lane(wave2_), largest_lane(rate2_), strayed(), !all(finite_), clamped_,
        plastic_work_};
  }

 private:
  bool strayed() const {
    return any(less(lowest_, splat_int(-kOneCell)) | less(splat_int(5 * kOneCell - 1), highest_));
  }

  Floats speed2_ = splat(0.f), wave2_ = splat(0.f), rate2_ = splat(0.f);
  Ints lowest_ = splat_int(0), highest_ = splat_int(0);  // of positions from the block's corner
  Mask finite_ = less(splat(0.f), splat(1.f));
  std::int32_t clamped_ = 0;
  std::int64_t plastic_work_ = 0;
};

}  // namespace firn::kernels::FIRN_ISA
