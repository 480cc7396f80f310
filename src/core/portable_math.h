// SPDX-License-Identifier: MIT
// sin, cos, exp, log, pow, cbrt and acos from +, *, / and sqrt alone: the same bits on every machine, where
// libm differs between systems. Absolute error below 1e-13 (sin, cos: for |x| < 1e5; acos), relative error
// below 1e-13 (the others).
#pragma once
#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace firn {

struct SinCos {
  double sin, cos;
};

// Taylor series on |r| <= pi/4 after subtracting the nearest multiple of pi/2 in two parts.
inline SinCos portable_sincos(double x) {
  const double quarter = std::floor(x * 0.63661977236758134308 + 0.5);
  const double r = (x - quarter * 1.5707963267341256) - quarter * 6.0771005063039659e-11;
  const double z = r * r;
  double s = -1.0 / 1307674368000;
  for (const double c :
       {1.0 / 6227020800, -1.0 / 39916800, 1.0 / 362880, -1.0 / 5040, 1.0 / 120, -1.0 / 6, 1.0}) {
    s = s * z + c;
  }
  s *= r;
  double c = 1.0 / 20922789888000;
  for (const double k :
       {-1.0 / 87178291200, 1.0 / 479001600, -1.0 / 3628800, 1.0 / 40320, -1.0 / 720, 1.0 / 24, -0.5, 1.0}) {
    c = c * z + k;
  }
  switch (static_cast<std::int64_t>(quarter) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

struct SinCosf {
  float sin, cos;
};

// Of a part of a full turn, in [0, 1]; error below 2e-7. Taylor series on an eighth of a turn to both sides
// of the nearest quarter.
inline SinCosf portable_sincos_turn(float turn) {
  const int quarter = static_cast<int>(4 * turn + 0.5f);
  const float a = (turn - 0.25f * static_cast<float>(quarter)) * 6.28318531f, z = a * a;
  float s = 1.f / 362880;
  for (const float k : {-1.f / 5040, 1.f / 120, -1.f / 6, 1.f}) s = s * z + k;
  s *= a;
  float c = -1.f / 3628800;
  for (const float k : {1.f / 40320, -1.f / 720, 1.f / 24, -0.5f, 1.f}) c = c * z + k;
  const bool odd = (quarter & 1) != 0, low = (quarter & 2) != 0, left = ((quarter + 1) & 2) != 0;
  const float up = odd ? c : s, right = odd ? s : c;
  return {low ? -up : up, left ? -right : right};
}

// 2^e for an integer exponent of a normal number.
inline double power_of_two(int e) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + e) << 52);
}

inline double portable_exp(double x) {
  if (x < -708) return 0;
  if (x > 709) return INFINITY;
  const double n = std::floor(x * 1.4426950408889634074 + 0.5);
  const double r = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10;
  // Taylor's series to the 13th power, |r| < 0.35; even and odd powers by themselves, as they then overlap.
  const double z = r * r;
  double even = 1.0 / 479001600, odd = 1.0 / 6227020800;
  for (const double c : {1.0 / 3628800, 1.0 / 40320, 1.0 / 720, 1.0 / 24, 0.5, 1.0}) even = even * z + c;
  for (const double c : {1.0 / 39916800, 1.0 / 362880, 1.0 / 5040, 1.0 / 120, 1.0 / 6, 1.0})
    odd = odd * z + c;
  const double sum = even + r * odd;
  const int half = static_cast<int>(n) / 2;
  return sum * power_of_two(half) * power_of_two(static_cast<int>(n) - half);
}

// Four at once in single precision, to 1.5e-7 of the result; for x < 88, 0 below -87.
inline Eigen::Array4f portable_expf(const Eigen::Array4f& x) {
  const Eigen::Array4f in = x.max(-87.f);
  const Eigen::Array4f n = (in * 1.44269504f + 0x1.8p23f) - 0x1.8p23f;  // the nearest integers
  const Eigen::Array4f r = (in - n * 0.693359375f) + n * 2.12194440e-4f, z = r * r;
  const Eigen::Array4f odd = ((1.f / 5040 * z + 1.f / 120) * z + 1.f / 6) * z + 1,
                       even = ((1.f / 720 * z + 1.f / 24) * z + 0.5f) * z + 1;
  const Eigen::Array4i bits = (n.cast<int>() + 127).shiftLeft<23>();
  Eigen::Array4f two_to_n;
  std::memcpy(two_to_n.data(), bits.data(), sizeof bits);
  return (x > -87.f).select((even + r * odd) * two_to_n, 0.f);
}

// x > 0 and normal. log m = 2 atanh((m-1)/(m+1)) with m in [sqrt(1/2), sqrt(2)).
inline double portable_log(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  int exponent = static_cast<int>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0xfffffffffffffull) | 0x3ff0000000000000ull);
  if (m > 1.4142135623730951) m *= 0.5, ++exponent;
  const double s = (m - 1) / (m + 1), z = s * s;
  double sum = 1.0 / 23;
  for (int k = 21; k >= 1; k -= 2) sum = sum * z + 1.0 / k;
  return exponent * 0.69314718055994530942 + 2 * s * sum;
}

// The same in single precision, to 2e-7 of the result or of 1, whichever is less.
inline float portable_logf(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  int exponent = static_cast<int>(bits >> 23) - 127;
  float m = std::bit_cast<float>((bits & 0x7fffff) | 0x3f800000);
  if (m > 1.41421356f) m *= 0.5f, ++exponent;
  const float s = (m - 1) / (m + 1), z = s * s;
  const float sum = (((1.f / 9 * z + 1.f / 7) * z + 1.f / 5) * z + 1.f / 3) * z + 1;
  return static_cast<float>(exponent) * 0.693147181f + 2 * s * sum;
}

// x >= 0.
inline double portable_pow(double x, double y) { return x <= 0 ? 0 : portable_exp(y * portable_log(x)); }

// x >= 0; two Newton steps after exp(log/3).
inline double portable_cbrt(double x) {
  if (!(x > 0)) return 0;
  double y = portable_exp(portable_log(x) / 3);
  for (int i = 0; i < 2; ++i) y -= (y * y * y - x) / (3 * y * y);
  return y;
}

// x in [-1, 1]: acos x = 2 atan(sqrt((1-x)/(1+x))), the argument halved three times, then the series.
inline double portable_acos(double x) {
  if (x >= 1) return 0;
  if (x <= -1) return 3.14159265358979323846;
  const bool obtuse = x < 0;
  double t = std::sqrt((1 - std::fabs(x)) / (1 + std::fabs(x)));
  for (int i = 0; i < 3; ++i) t = t / (1 + std::sqrt(1 + t * t));
  const double z = t * t;
  double sum = 1.0 / 17;
  for (int k = 15; k >= 1; k -= 2) sum = 1.0 / k - sum * z;
  const double angle = 16 * t * sum;
  return obtuse ? 3.14159265358979323846 - angle : angle;
}

}  // namespace firn
