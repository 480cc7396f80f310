// SPDX-License-Identifier: MIT
// exp, log, sine and cosine in lanes, by polynomials of our own: libm differs between systems, these give the
// same bits everywhere.
#pragma once
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

// exp(x), relative error below 2e-7; x is clamped to [-87, 88], where the result is a normal float.
FIRN_INLINE Floats exp(Floats x) {
  const Floats clamped = min(max(x, splat(-87.f)), splat(88.f));
  const Ints n = round_to_int(clamped * splat(1.44269504f));
  const Floats nf = to_float(n);
  Floats r = fma(nf, splat(-0.693359375f), clamped);  // ln 2 in two parts: the first is exact in 10 bits
  r = fma(nf, splat(2.12194440e-4f), r);
  Floats p = splat(1.f / 5040);
  p = fma(p, r, splat(1.f / 720));
  p = fma(p, r, splat(1.f / 120));
  p = fma(p, r, splat(1.f / 24));
  p = fma(p, r, splat(1.f / 6));
  p = fma(p, r, splat(0.5f));
  p = fma(p, r, splat(1.f));
  p = fma(p, r, splat(1.f));
  return p * (Floats)((n + 127) << 23);
}

// ln(x) for normal x > 0, relative error below 2e-7 also near 1: x = 2^n m with m in [sqrt(1/2), sqrt(2)),
// ln m = 2 artanh((m - 1)/(m + 1)).
FIRN_INLINE Floats log(Floats x) {
  const Ints shifted = (Ints)x - 0x3f3504f3;  // bits of sqrt(1/2)
  const Ints n = shifted >> 23;
  const Floats m = (Floats)((shifted & 0x007fffff) + 0x3f3504f3);
  const Floats s = (m - splat(1.f)) / (m + splat(1.f));
  const Floats s2 = s * s;
  Floats p = splat(2.f / 9);
  p = fma(p, s2, splat(2.f / 7));
  p = fma(p, s2, splat(2.f / 5));
  p = fma(p, s2, splat(2.f / 3));
  p = fma(p * s2, s, s + s);
  const Floats nf = to_float(n);
  return fma(nf, splat(0.693359375f), fma(nf, splat(-2.12194440e-4f), p));
}

// Sine and cosine of 2 pi x for 0 <= x <= 1, absolute error below 2e-7: Taylor within an eighth of a turn.
FIRN_INLINE void sincos_turn(Floats x, Floats& sine, Floats& cosine) {
  const Ints quarter = round_to_int(x * splat(4.f));
  const Floats a = fma(to_float(quarter), splat(-0.25f), x) * splat(6.28318531f), a2 = a * a;
  Floats s = splat(1.f / 362880);
  s = fma(s, a2, splat(-1.f / 5040));
  s = fma(s, a2, splat(1.f / 120));
  s = fma(s, a2, splat(-1.f / 6));
  s = fma(s * a2, a, a);
  Floats c = splat(1.f / 40320);
  c = fma(c, a2, splat(-1.f / 720));
  c = fma(c, a2, splat(1.f / 24));
  c = fma(c, a2, splat(-0.5f));
  c = fma(c, a2, splat(1.f));
  const Mask odd = equal(quarter & 1, splat_int(1)), low = equal(quarter & 2, splat_int(2));
  const Mask left = equal((quarter + 1) & 2, splat_int(2));
  const Floats up = select(odd, c, s), right = select(odd, s, c);
  sine = select(low, -up, up);
  cosine = select(left, -right, right);
}

}  // namespace firn::kernels::FIRN_ISA
