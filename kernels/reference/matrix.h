// SPDX-License-Identifier: MIT
// What the twins of the materials are written with. Matrices are row-major.
#pragma once
#include "kernels/materials/params.h"

namespace firn::kernels::reference {

// One for each material, in its file, of static functions:
//   void stress(params, f, jp, tau)      Kirchhoff stress
//   double energy(params, f, jp)         J per m^3 of placed volume
//   double wave_speed2(params, f, jp)    m^2/s^2, of the fastest elastic wave
//   bool project(params, f, jp)          through the yield surface, in place; true when F changed
template <class Material>
struct Twin;

// F = U diag(s) V^T with rotations U and V, s[0] >= s[1] >= |s[2]|.
void svd(const double f[9], double u[9], double s[3], double v[9]);
void compose(const double u[9], const double s[3], const double v[9], double out[9]);

double determinant(const double a[9]);
double norm2(const double a[9]);                                            // sum of squares
void times_transpose(const double a[9], const double b[9], double out[9]);  // a b^T

double clamped(double x, double low, double high);

// Clamps the singular values of F to [sigma_min, sigma_max] and moves the lost volume change into Jp.
bool clamp_stretches(const SharedParams& p, double f[9], double& jp);

// The largest squared stretch, bounded by |F|^2 - 2.
double stretch2_bound(const double f[9]);

}  // namespace firn::kernels::reference
