// SPDX-License-Identifier: MIT
// Singular values of F clamped to [lo, hi], only where it changes something: all of them lie inside exactly
// when F^T F - lo^2 I and hi^2 I - F^T F are positive definite and det F > 0, which costs a tenth of an SVD.
// A lane that passes keeps every bit of its F, whatever its neighbours need.
#pragma once
#include "kernels/mpm/views.h"
#include "kernels/simd/svd3.h"

namespace firn::kernels::FIRN_ISA {

FIRN_INLINE Mask inside_box(const Mat3& f, Floats lo, Floats hi) {
  const Sym3 c = transpose_times(f);
  return positive_definite(add_diagonal(c, -(lo * lo))) &
         positive_definite(add_diagonal(c * splat(-1.f), hi * hi)) & less(splat(0.f), det(f));
}

inline void clamp_by_svd(Mat3& f, Floats lo, Floats hi, Mask& changed, Floats& volume_ratio) {
  Svd3 d;
  svd3(f, d);
  Floats s[3], before = splat(1.f), after = splat(1.f);
  Mask moved = less(splat(1.f), splat(0.f));
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    s[i] = min(max(d.s[i], lo), hi);
    moved = moved | less(d.s[i], s[i]) | less(s[i], d.s[i]);
    before = before * d.s[i];
    after = after * s[i];
  }
  changed = changed & moved;
  f = select(changed, compose(d, s), f);
  volume_ratio = before / after;
}

// Clamps F in the `active` lanes and moves the lost volume change into Jp, which stays in [jp_min, jp_max].
// Returns the lanes whose F changed.
FIRN_INLINE Mask clamp_into_jp(const MaterialParams& p, Mat3& f, Floats& jp, Mask active) {
  const Floats lo = splat(p.sigma_min), hi = splat(p.sigma_max);
  Mask changed = active & !inside_box(f, lo, hi);
  if (!any(changed)) return changed;
  Floats volume_ratio;
  clamp_by_svd(f, lo, hi, changed, volume_ratio);
  jp = select(changed, min(max(jp * volume_ratio, splat(p.jp_min)), splat(p.jp_max)), jp);
  return changed;
}

}  // namespace firn::kernels::FIRN_ISA
