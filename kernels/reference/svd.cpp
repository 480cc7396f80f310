// SPDX-License-Identifier: MIT
// One-sided Jacobi in double, to convergence.
#include <cmath>

#include "kernels/reference/mpm.h"

namespace firn::kernels::reference {

namespace {

double column_dot(const double a[9], int p, int q) {
  return a[p] * a[q] + a[3 + p] * a[3 + q] + a[6 + p] * a[6 + q];
}

void rotate_columns(double a[9], int p, int q, double c, double s) {
  for (int r = 0; r < 3; ++r) {
    const double x = a[3 * r + p], y = a[3 * r + q];
    a[3 * r + p] = c * x - s * y;
    a[3 * r + q] = s * x + c * y;
  }
}

void orthogonalise(double a[9], double v[9], int p, int q) {
  const double gamma = column_dot(a, p, q);
  const double delta = column_dot(a, q, q) - column_dot(a, p, p);
  if (gamma == 0) return;
  const double t = 2 * gamma / (delta + std::copysign(std::hypot(delta, 2 * gamma), delta));
  const double c = 1 / std::sqrt(1 + t * t);
  rotate_columns(a, p, q, c, c * t);
  rotate_columns(v, p, q, c, c * t);
}

void cross_columns(const double a[9], int p, int q, double out[3]) {
  for (int r = 0; r < 3; ++r) {
    const int i = (r + 1) % 3, j = (r + 2) % 3;
    out[r] = a[3 * i + p] * a[3 * j + q] - a[3 * j + p] * a[3 * i + q];
  }
}

// Column c of u becomes `from` less its part along column 0 (if c > 0), of unit length; false when nothing is
// left.
bool set_direction(double u[9], int c, const double from[3], double smallest) {
  double w[3] = {from[0], from[1], from[2]};
  for (int pass = 0; c > 0 && pass < 2; ++pass) {
    const double along = w[0] * u[0] + w[1] * u[3] + w[2] * u[6];
    for (int r = 0; r < 3; ++r) w[r] -= along * u[3 * r];
  }
  const double length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  if (!(length > smallest)) return false;
  for (int r = 0; r < 3; ++r) u[3 * r + c] = w[r] / length;
  return true;
}

}  // namespace

double determinant(const double a[9]) {
  return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) +
         a[2] * (a[3] * a[7] - a[4] * a[6]);
}

void svd(const double f[9], double u[9], double s[3], double v[9]) {
  double a[9];
  for (int k = 0; k < 9; ++k) {
    a[k] = f[k];
    v[k] = k % 4 == 0 ? 1 : 0;
  }
  for (int sweep = 0; sweep < 30; ++sweep) {
    orthogonalise(a, v, 0, 1);
    orthogonalise(a, v, 0, 2);
    orthogonalise(a, v, 1, 2);
  }
  const int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (const auto& pair : pairs) {  // longest first, by quarter turns
    if (column_dot(a, pair[0], pair[0]) >= column_dot(a, pair[1], pair[1])) continue;
    rotate_columns(a, pair[0], pair[1], 0, -1);
    rotate_columns(v, pair[0], pair[1], 0, -1);
  }
  const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const double first[3] = {a[0], a[3], a[6]}, second[3] = {a[1], a[4], a[7]};
  const double largest = std::sqrt(column_dot(a, 0, 0));
  if (!set_direction(u, 0, first, 0)) set_direction(u, 0, axes[0], 0);
  if (!set_direction(u, 1, second, 1e-15 * largest)) {
    const int axis = std::fabs(u[0]) > 0.6 ? 1 : 0;
    set_direction(u, 1, axes[axis], 0);
  }
  double third[3];
  cross_columns(u, 0, 1, third);
  for (int r = 0; r < 3; ++r) u[3 * r + 2] = third[r];
  for (int c = 0; c < 3; ++c) s[c] = u[c] * a[c] + u[3 + c] * a[3 + c] + u[6 + c] * a[6 + c];
}

}  // namespace firn::kernels::reference
