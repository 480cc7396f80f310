// SPDX-License-Identifier: MIT
// The left stretch of F less the identity, G = sqrt(F F^T) - I = U (S - I) U^T, and E = F F^T - I: all that
// fixed-corotated elasticity needs of the polar decomposition, as G + G^2 = E - G. Snow stays within a few
// per cent of a rotation, where a power series in E is exact to round-off; its powers reduce to I, E and E^2
// (Cayley-Hamilton: E^3 = I1 E^2 - I2 E + I3 I). Lanes outside go through the SVD, each by its own criterion.
#pragma once
#include "kernels/simd/svd3.h"

namespace firn::kernels::FIRN_ISA {

FIRN_INLINE Sym3 strain_of(const Mat3& f) { return add_diagonal(times_transpose(f), splat(-1.f)); }  // E

// sqrt(I + E) - I for |E| <= kSeriesRadius: binomial series to E^7, remainder below 4e-9.
inline constexpr float kSeriesRadius = 0.1f;

// A polynomial c0 + c1 E + c2 E^2 times E, plus a.
struct Invariants {
  Floats first, second, third;
};
struct Quadratic {
  Floats c0, c1, c2;
};
FIRN_INLINE Quadratic horner(const Quadratic& p, const Invariants& i, float a) {
  return {fma(p.c2, i.third, splat(a)), fma(p.c2, -i.second, p.c0), fma(p.c2, i.first, p.c1)};
}

FIRN_INLINE Sym3 stretch_series(const Sym3& e) {
  const Sym3 e2 = commuting_product(e, e);
  const Floats first = trace(e);
  const Invariants i{first, splat(0.5f) * fma(first, first, -trace(e2)), determinant(e)};
  Quadratic p{splat(7.f / 256), splat(-21.f / 1024), splat(33.f / 2048)};
  p = horner(p, i, -5.f / 128);
  p = horner(p, i, 1.f / 16);
  p = horner(p, i, -1.f / 8);
  p = horner(p, i, 1.f / 2);
  p = horner(p, i, 0.f);
  return add_diagonal(e2 * p.c2 + e * p.c1, p.c0);
}

// Rare, and too long to stand in every kernel.
__attribute__((noinline, cold)) inline Sym3 stretch_by_svd(const Mat3& f) {
  Svd3 d;
  svd3(f, d);
  const Floats one = splat(1.f);
  const Floats g0 = d.s[0] - one, g1 = d.s[1] - one, g2 = d.s[2] - one;
  const Vec3 a = d.u[0], b = d.u[1], c = d.u[2];
  return {fma(g0, a.x * a.x, fma(g1, b.x * b.x, g2 * (c.x * c.x))),
          fma(g0, a.y * a.y, fma(g1, b.y * b.y, g2 * (c.y * c.y))),
          fma(g0, a.z * a.z, fma(g1, b.z * b.z, g2 * (c.z * c.z))),
          fma(g0, a.x * a.y, fma(g1, b.x * b.y, g2 * (c.x * c.y))),
          fma(g0, a.x * a.z, fma(g1, b.x * b.z, g2 * (c.x * c.z))),
          fma(g0, a.y * a.z, fma(g1, b.y * b.z, g2 * (c.y * c.z)))};
}

// G, from F, E and det F.
FIRN_INLINE Sym3 stretch_of(const Mat3& f, const Sym3& e, Floats det_f) {
  // A reflection near the identity has a small E too: only the SVD gives its signed stretch.
  const Mask near_rotation = less(norm2(e), splat(kSeriesRadius * kSeriesRadius)) & less(splat(0.f), det_f);
  const Sym3 series = stretch_series(e);
  if (all(near_rotation)) [[likely]]
    return series;
  return select(near_rotation, series, stretch_by_svd(in_memory(f)));
}

}  // namespace firn::kernels::FIRN_ISA
