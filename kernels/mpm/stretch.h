// SPDX-License-Identifier: MIT
// The left stretch of F less the identity, G = sqrt(F F^T) - I = U (S - I) U^T: all that fixed-corotated
// elasticity needs of the polar decomposition. Snow stays within a few per cent of a rotation, where a power
// series in E = F F^T - I is exact to round-off; lanes outside that go through the SVD, each lane by its own
// criterion.
#pragma once
#include "kernels/simd/svd3.h"

namespace firn::kernels::FIRN_ISA {

// sqrt(I + E) - I for |E| <= kSeriesRadius: binomial series to E^7, remainder below 4e-9.
inline constexpr float kSeriesRadius = 0.1f;

FIRN_INLINE Sym3 stretch_series(const Sym3& e) {
  Sym3 p = add_diagonal(e * splat(33.f / 2048), splat(-21.f / 1024));
  p = add_diagonal(commuting_product(p, e), splat(7.f / 256));
  p = add_diagonal(commuting_product(p, e), splat(-5.f / 128));
  p = add_diagonal(commuting_product(p, e), splat(1.f / 16));
  p = add_diagonal(commuting_product(p, e), splat(-1.f / 8));
  p = add_diagonal(commuting_product(p, e), splat(1.f / 2));
  return commuting_product(p, e);
}

inline void stretch_by_svd(const Mat3& f, Sym3& out) {
  Svd3 d;
  svd3(f, d);
  const Floats one = splat(1.f);
  const Floats g0 = d.s[0] - one, g1 = d.s[1] - one, g2 = d.s[2] - one;
  const Vec3 a = d.u[0], b = d.u[1], c = d.u[2];
  out = {fma(g0, a.x * a.x, fma(g1, b.x * b.x, g2 * (c.x * c.x))),
         fma(g0, a.y * a.y, fma(g1, b.y * b.y, g2 * (c.y * c.y))),
         fma(g0, a.z * a.z, fma(g1, b.z * b.z, g2 * (c.z * c.z))),
         fma(g0, a.x * a.y, fma(g1, b.x * b.y, g2 * (c.x * c.y))),
         fma(g0, a.x * a.z, fma(g1, b.x * b.z, g2 * (c.x * c.z))),
         fma(g0, a.y * a.z, fma(g1, b.y * b.z, g2 * (c.y * c.z)))};
}

FIRN_INLINE Sym3 stretch_less_identity(const Mat3& f) {
  const Sym3 e = add_diagonal(times_transpose(f), splat(-1.f));
  // A reflection near the identity has a small E too: only the SVD gives its signed stretch.
  const Mask near_rotation = less(norm2(e), splat(kSeriesRadius * kSeriesRadius)) & less(splat(0.f), det(f));
  const Sym3 series = stretch_series(e);
  if (all(near_rotation)) [[likely]]
    return series;
  Sym3 exact;
  stretch_by_svd(f, exact);
  return select(near_rotation, series, exact);
}

}  // namespace firn::kernels::FIRN_ISA
