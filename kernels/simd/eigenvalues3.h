// SPDX-License-Identifier: MIT
// Eigenvalues of a symmetric 3x3 matrix in lanes, ascending, by cyclic Jacobi rotations. Eight of them leave
// the off-diagonal below round-off of the largest entry (measured on random, nearly double and nearly triple
// spectra); no vectors are kept, which is what makes them cheap.
#pragma once
#include "kernels/simd/mat3.h"

namespace firn::kernels::FIRN_ISA {

// Rotates in the plane of p and q so that their off-diagonal entry pq vanishes; pr and qr turn along.
FIRN_INLINE void annihilate(Floats& pp, Floats& qq, Floats& pq, Floats& pr, Floats& qr) {
  const Floats d = qq - pp, twice = pq + pq;
  const Floats root = sqrt(fma(d, d, twice * twice));
  const Floats t = twice / (d + copy_sign(root + splat(1e-30f), d));
  const Floats c = splat(1.f) / sqrt(fma(t, t, splat(1.f)));
  const Floats s = t * c;
  pp = fma(-t, pq, pp);
  qq = fma(t, pq, qq);
  pq = splat(0.f);
  const Floats old = pr;
  pr = fma(c, old, -(s * qr));
  qr = fma(s, old, c * qr);
}

FIRN_INLINE void order(Floats& low, Floats& high) {
  const Floats old = low;
  low = min(old, high);
  high = max(old, high);
}

FIRN_INLINE void eigenvalues3(Sym3 a, Floats (&out)[3]) {
#pragma GCC unroll 2
  for (int sweep = 0; sweep < 2; ++sweep) {
    annihilate(a.xx, a.yy, a.xy, a.xz, a.yz);
    annihilate(a.xx, a.zz, a.xz, a.xy, a.yz);
    annihilate(a.yy, a.zz, a.yz, a.xy, a.xz);
  }
  annihilate(a.xx, a.yy, a.xy, a.xz, a.yz);
  annihilate(a.xx, a.zz, a.xz, a.xy, a.yz);
  order(a.xx, a.yy);
  order(a.yy, a.zz);
  order(a.xx, a.yy);
  out[0] = a.xx;
  out[1] = a.yy;
  out[2] = a.zz;
}

}  // namespace firn::kernels::FIRN_ISA
