// SPDX-License-Identifier: MIT
// Singular values of F clamped to [lo, hi], only where it changes something: all of them lie inside when F
// F^T - lo^2 I and hi^2 I - F F^T are positive definite and det F > 0, which costs a tenth of a
// decomposition. The test is on the safe side of its round-off, so that only the decomposition decides what
// is clamped: asking first saves time and changes no bit (tests/kernels/test_yielding.cpp).
//
// The clamped F is f(E) F with E = F F^T - I and f(e) = clamp(sqrt(1 + e)) / sqrt(1 + e): a function of a
// symmetric matrix, for which the eigenvalues of E and Newton's interpolation suffice. Snow leaves the box by
// little, and E then carries its stretch to round-off. Lanes that are far from a rotation, where E loses
// small stretches, go through the SVD, each by its own criterion.
#pragma once
#include "kernels/materials/params.h"
#include "kernels/mpm/stretch.h"
#include "kernels/simd/eigenvalues3.h"

namespace firn::kernels::FIRN_ISA {

// False within 1e-6 of the box's sides, which is more than what the decomposition is off.
FIRN_INLINE Mask inside_box(const Deformation& d, float lo, float hi) {
  const float margin = hi * 1e-6f, inner_lo = lo + margin, inner_hi = hi - margin;
  return surely_positive_definite(add_diagonal(d.e, splat(1.f - inner_lo * inner_lo))) &
         surely_negative_definite(add_diagonal(d.e, splat(1.f - inner_hi * inner_hi))) &
         less(splat(0.f), d.j);
}

struct Clamped {
  Mask changed;
  Mat3 f;
  Floats volume_ratio;  // before / after
};

// Rare, and too long to stand in every kernel.
__attribute__((noinline, cold)) inline Clamped clamped_by_svd(const Mat3& f, Floats lo, Floats hi) {
  Svd3 d;
  svd3(f, d);
  Floats s[3], before = splat(1.f), after = splat(1.f);
  Mask changed = less(splat(1.f), splat(0.f));
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    s[i] = min(max(d.s[i], lo), hi);
    changed = changed | less(d.s[i], s[i]) | less(s[i], d.s[i]);
    before = before * d.s[i];
    after = after * s[i];
  }
  return {changed, compose(d, s), before / after};
}

// Newton's interpolation of h at e0 <= e1 <= e2: h(E) = h0 + h01 (E - e0) + h012 (E - e0)(E - e1). Where two
// eigenvalues meet, their quotient is noise of at most kSteepest: |f'| < 1.5 for e > -1/2.
inline constexpr float kSteepest = 2.f;

FIRN_INLINE Sym3 interpolate(const Floats (&at)[3], const Floats (&h)[3], const Sym3& e) {
  const auto steep = [](Floats a)
                         FIRN_INLINE_LAMBDA { return min(max(a, splat(-kSteepest)), splat(kSteepest)); };
  const Floats tiny = splat(1e-12f);
  const Floats d01 = max(at[1] - at[0], tiny), d12 = max(at[2] - at[1], tiny), d02 = max(at[2] - at[0], tiny);
  const Floats inverse = splat(1.f) / (d01 * d12 * d02);
  const Floats h01 = steep((h[1] - h[0]) * (d12 * d02 * inverse));
  const Floats h12 = steep((h[2] - h[1]) * (d01 * d02 * inverse));
  const Floats h012 = (h12 - h01) * (d01 * d12 * inverse);
  const Sym3 from0 = add_diagonal(e, -at[0]), from1 = add_diagonal(e, -at[1]);
  return add_diagonal(from0 * h01 + commuting_product(from0, from1) * h012, h[0]);
}

FIRN_INLINE Clamped clamped_by_eigenvalues(const Mat3& f, const Sym3& e, Floats lo, Floats hi) {
  const Floats one = splat(1.f);
  Floats at[3], h[3];  // eigenvalues, f - 1
  eigenvalues3(e, at);
  Mask changed = less(one, splat(0.f));
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    const Floats s = sqrt(one + at[i]), to = min(max(s, lo), hi);
    changed = changed | less(s, to) | less(to, s);
    h[i] = (to - s) / s;
  }
  return {changed, add_product(f, interpolate(at, h, e), f),
          one / ((one + h[0]) * (one + h[1]) * (one + h[2]))};
}

// |E| up to which its eigenvalues are used.
inline constexpr float kNearRotation = 0.5f;

// Clamps F in the `active` lanes and moves the lost volume change into Jp, which stays in [jp_min, jp_max].
// Returns the lanes whose F changed.
FIRN_INLINE Mask clamp_into_jp(const SharedParams& p, Mat3& f, Floats& jp, Mask active) {
  const Floats lo = splat(p.sigma_min), hi = splat(p.sigma_max);
  const Deformation d = deformation_of(f);
  const Mask near = less(norm2(d.e), splat(kNearRotation * kNearRotation)) & less(splat(0.f), d.j);
  Clamped c = clamped_by_eigenvalues(f, d.e, lo, hi);
  if (!all(near)) [[unlikely]] {
    const Clamped exact = clamped_by_svd(in_memory(f), lo, hi);
    c = {(near & c.changed) | ((!near) & exact.changed), select(near, c.f, exact.f),
         select(near, c.volume_ratio, exact.volume_ratio)};
  }
  const Mask changed = active & c.changed;
  f = select(changed, c.f, f);
  jp = select(changed, min(max(jp * c.volume_ratio, splat(p.jp_min)), splat(p.jp_max)), jp);
  return changed;
}

}  // namespace firn::kernels::FIRN_ISA
