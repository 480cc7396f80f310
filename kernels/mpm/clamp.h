// SPDX-License-Identifier: MIT
// Singular values of F clamped to [lo, hi], only where it changes something: all of them lie inside exactly
// when F F^T - lo^2 I and hi^2 I - F F^T are positive definite and det F > 0, which costs a tenth of a
// decomposition. A lane that passes keeps every bit of its F, whatever its neighbours need.
//
// The clamped F is f(E) F with E = F F^T - I and f(e) = clamp(sqrt(1 + e)) / sqrt(1 + e): a function of a
// symmetric matrix, for which the eigenvalues of E and Newton's interpolation suffice. Snow leaves the box by
// little, and E then carries its stretch to round-off. Lanes that are far from a rotation, where E loses
// small stretches, go through the SVD, each by its own criterion.
#pragma once
#include "kernels/mpm/views.h"
#include "kernels/simd/eigenvalues3.h"
#include "kernels/simd/svd3.h"

namespace firn::kernels::FIRN_ISA {

FIRN_INLINE Mask inside_box(const Mat3& f, Floats lo, Floats hi) {
  const Floats one = splat(1.f);
  const Sym3 e = add_diagonal(times_transpose(f), -one);
  return positive_definite(add_diagonal(e, one - lo * lo)) &
         positive_definite(add_diagonal(e * -one, hi * hi - one)) & less(splat(0.f), det(f));
}

struct Clamped {
  Mask changed;
  Mat3 f;
  Floats volume_ratio;  // before / after
};

FIRN_INLINE Clamped clamped_by_svd(const Mat3& f, Floats lo, Floats hi) {
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

// Where two eigenvalues meet, their quotient is noise of at most this size: |f'| < 1.5 for e > -1/2.
inline constexpr float kSteepest = 2.f;

FIRN_INLINE Floats slope(Floats f0, Floats f1, Floats e0, Floats e1) {
  const Floats quotient = (f1 - f0) / max(e1 - e0, splat(1e-12f));
  return min(max(quotient, splat(-kSteepest)), splat(kSteepest));
}

FIRN_INLINE Clamped clamped_by_eigenvalues(const Mat3& f, const Sym3& e, Floats lo, Floats hi) {
  const Floats one = splat(1.f);
  Floats at[3], s[3], to[3], h[3];  // eigenvalues, stretches, clamped stretches, f - 1
  eigenvalues3(e, at);
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    s[i] = sqrt(one + at[i]);
    to[i] = min(max(s[i], lo), hi);
    h[i] = (to[i] - s[i]) / s[i];
  }
  const Floats h01 = slope(h[0], h[1], at[0], at[1]), h12 = slope(h[1], h[2], at[1], at[2]);
  const Floats h012 = (h12 - h01) / max(at[2] - at[0], splat(1e-12f));
  const Sym3 from0 = add_diagonal(e, -at[0]), from1 = add_diagonal(e, -at[1]);
  const Sym3 p = add_diagonal(from0 * h01 + commuting_product(from0, from1) * h012, h[0]);
  return {less(s[0], to[0]) | less(to[2], s[2]) | less(to[0], s[0]) | less(s[2], to[2]), add_product(f, p, f),
          (s[0] * s[1] * s[2]) / (to[0] * to[1] * to[2])};
}

// |E| up to which its eigenvalues are used.
inline constexpr float kNearRotation = 0.5f;

// Clamps F in the `active` lanes and moves the lost volume change into Jp, which stays in [jp_min, jp_max].
// Returns the lanes whose F changed.
FIRN_INLINE Mask clamp_into_jp(const MaterialParams& p, Mat3& f, Floats& jp, Mask active) {
  const Floats lo = splat(p.sigma_min), hi = splat(p.sigma_max);
  const Sym3 e = add_diagonal(times_transpose(f), splat(-1.f));
  const Mask near = less(norm2(e), splat(kNearRotation * kNearRotation)) & less(splat(0.f), det(f));
  Clamped c = clamped_by_eigenvalues(f, e, lo, hi);
  if (!all(near)) [[unlikely]] {
    const Clamped exact = clamped_by_svd(f, lo, hi);
    c = {(near & c.changed) | ((!near) & exact.changed), select(near, c.f, exact.f),
         select(near, c.volume_ratio, exact.volume_ratio)};
  }
  const Mask changed = active & c.changed;
  f = select(changed, c.f, f);
  jp = select(changed, min(max(jp * c.volume_ratio, splat(p.jp_min)), splat(p.jp_max)), jp);
  return changed;
}

}  // namespace firn::kernels::FIRN_ISA
