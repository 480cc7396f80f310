// SPDX-License-Identifier: MIT
// What materials read of F: E = F F^T - I and J = det F; and the left stretch less the identity, G = sqrt(F
// F^T) - I = U (S - I) U^T, which is all that fixed-corotated elasticity needs of the polar decomposition.
// Snow stays within a few per cent of a rotation, where G is a polynomial in E to round-off; its powers
// reduce to I, E and E^2 (Cayley-Hamilton: E^3 = I1 E^2 - I2 E + I3 I). Lanes outside go through the SVD,
// each by its own criterion.
#pragma once
#include "kernels/simd/svd3.h"

namespace firn::kernels::FIRN_ISA {

// The kernels of a material, one for each, in its file, of static functions: stress, energy, wave_speed2,
// yields, project.
template <class Material>
struct Lanes;

struct Deformation {
  Mat3 f;
  Sym3 e;    // F F^T - I
  Floats j;  // det F
};
FIRN_INLINE Deformation deformation_of(const Mat3& f) {
  return {f, add_diagonal(times_transpose(f), splat(-1.f)), det(f)};
}

// c0 I + c1 E + c2 E^2
struct Quadratic {
  Floats c0, c1, c2;
};
FIRN_INLINE Sym3 evaluate(const Quadratic& p, const Sym3& e, const Sym3& e2) {
  return add_diagonal(add_scaled(e * p.c1, e2, p.c2), p.c0);
}

// Of E: I1, -I2 and I3.
struct Invariants {
  Floats first, minus_second, third;
};
FIRN_INLINE Quadratic times_e_plus(const Quadratic& p, const Invariants& i, float a) {
  return {fma(p.c2, i.third, splat(a)), fma(p.c2, i.minus_second, p.c0), fma(p.c2, i.first, p.c1)};
}

// sqrt(1 + e) - 1 = a1 e + .. + a5 e^5 for |e| <= kSeriesRadius: the minimax polynomial, off by 1.5e-8 |e| at
// most.
inline constexpr float kSeriesRadius = 0.1f;
inline constexpr float kSeries[5] = {0.5f, -0.12499935f, 0.06249867f, -0.03932058f, 0.027628275f};

FIRN_INLINE Quadratic stretch_series(const Deformation& d, const Sym3& e2) {
  const Floats first = trace(d.e), half = splat(0.5f);
  const Floats minus_second = half * fma(-first, first, trace(e2));
  const Invariants i{first, minus_second, determinant(d.e)};
  Quadratic p{splat(kSeries[2]), splat(kSeries[3]), splat(kSeries[4])};
  p = times_e_plus(p, i, kSeries[1]);
  p = times_e_plus(p, i, kSeries[0]);
  return times_e_plus(p, i, 0.f);
}

// U diag(g) U^T
FIRN_INLINE Sym3 along_left_axes(const Svd3& d, Floats g0, Floats g1, Floats g2) {
  const Vec3 a = d.u[0], b = d.u[1], c = d.u[2];
  return {fma(g0, a.x * a.x, fma(g1, b.x * b.x, g2 * (c.x * c.x))),
          fma(g0, a.y * a.y, fma(g1, b.y * b.y, g2 * (c.y * c.y))),
          fma(g0, a.z * a.z, fma(g1, b.z * b.z, g2 * (c.z * c.z))),
          fma(g0, a.x * a.y, fma(g1, b.x * b.y, g2 * (c.x * c.y))),
          fma(g0, a.x * a.z, fma(g1, b.x * b.z, g2 * (c.x * c.z))),
          fma(g0, a.y * a.z, fma(g1, b.y * b.z, g2 * (c.y * c.z)))};
}

// Rare, and too long to stand in every kernel.
__attribute__((noinline, cold)) inline Sym3 stretch_by_svd(const Mat3& f) {
  Svd3 d;
  svd3(f, d);
  const Floats one = splat(1.f);
  return along_left_axes(d, d.s[0] - one, d.s[1] - one, d.s[2] - one);
}

// Where the series holds. A reflection near the identity has a small E too: only the SVD gives its signed
// stretch.
FIRN_INLINE Mask near_rotation(const Deformation& d) {
  return less(norm2(d.e), splat(kSeriesRadius * kSeriesRadius)) & less(splat(0.f), d.j);
}

FIRN_INLINE Sym3 stretch_of(const Deformation& d) {  // G
  const Mask near = near_rotation(d);
  const Sym3 e2 = commuting_product(d.e, d.e);
  const Sym3 series = evaluate(stretch_series(d, e2), d.e, e2);
  if (all(near)) [[likely]]
    return series;
  return select(near, series, stretch_by_svd(in_memory(d.f)));
}

// k (E - G) + p I
FIRN_INLINE Sym3 corotated_stress(const Deformation& d, Floats k, Floats p) {
  return add_diagonal((d.e - stretch_of(d)) * k, p);
}

}  // namespace firn::kernels::FIRN_ISA
