// SPDX-License-Identifier: MIT
#include "src/render/lights/day_sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr double kLowest = 0.01;  // sine of the elevation below which the sky stays as it is there

// The paper's A.2: a column's value is slope * turbidity + offset.
struct Line {
  double slope, offset;
  double at(double turbidity) const { return slope * turbidity + offset; }
};
constexpr Line kLuminance[] = {
    {0.1787, -1.4630}, {-0.3554, 0.4275}, {-0.0227, 5.3251}, {0.1206, -2.5771}, {-0.0670, 0.3703}};
constexpr Line kX[] = {
    {-0.0193, -0.2592}, {-0.0665, 0.0008}, {-0.0004, 0.2125}, {-0.0641, -0.8989}, {-0.0033, 0.0452}};
constexpr Line kY[] = {
    {-0.0167, -0.2608}, {-0.0950, 0.0092}, {-0.0079, 0.2102}, {-0.0441, -1.6537}, {-0.0109, 0.0529}};

// Rows: turbidity squared, turbidity, 1; columns: the sun's angle from the zenith cubed, ..., 1.
constexpr double kZenithX[3][4] = {{0.00166, -0.00375, 0.00209, 0},
                                   {-0.02903, 0.06377, -0.03202, 0.00394},
                                   {0.11693, -0.21196, 0.06052, 0.25886}};
constexpr double kZenithY[3][4] = {{0.00275, -0.00610, 0.00317, 0},
                                   {-0.04214, 0.08970, -0.04153, 0.00516},
                                   {0.15346, -0.26756, 0.06670, 0.26688}};

double zenith_chromaticity(const double (&table)[3][4], double turbidity, double angle) {
  double sum = 0;
  for (const auto& row : table) {
    sum = sum * turbidity + ((row[0] * angle + row[1]) * angle + row[2]) * angle + row[3];
  }
  return sum;
}

double zenith_luminance(double turbidity, double angle) {  // kcd/m^2
  const SinCos chi = portable_sincos((4.0 / 9 - turbidity / 120) * (std::numbers::pi - 2 * angle));
  return (4.0453 * turbidity - 4.9710) * (chi.sin / chi.cos) - 0.2155 * turbidity + 2.4192;
}

// CIE xyY to linear sRGB (IEC 61966-2-1); colours outside it go to its border.
Vec3f linear_srgb(double x, double y, double luminance) {
  const double big_x = luminance * x / y, big_z = luminance * (1 - x - y) / y;
  const Vec3 rgb(3.2406 * big_x - 1.5372 * luminance - 0.4986 * big_z,
                 -0.9689 * big_x + 1.8758 * luminance + 0.0415 * big_z,
                 0.0557 * big_x - 0.2040 * luminance + 1.0570 * big_z);
  return rgb.cwiseMax(0).cast<float>();
}

}  // namespace

double DaySky::Perez::at(double cos_zenith, double sun_angle, double cos_sun) const {
  return zenith * (1 + a[0] * portable_exp(a[1] / cos_zenith)) *
         (1 + a[2] * portable_exp(a[3] * sun_angle) + a[4] * cos_sun * cos_sun);
}

DaySky::DaySky(const DaySkyLight& light)
    : sun_(light.sun.normalized()), scale_(light.scale), ground_(light.ground) {
  const double height = std::clamp(sun_.y(), 0.0, 1.0), angle = portable_acos(height);
  const auto fit = [&](const Line(&lines)[5], double zenith) {
    Perez perez{{}, 1};
    for (int k = 0; k < 5; ++k) perez.a[k] = lines[k].at(light.turbidity);
    perez.zenith = zenith / perez.at(1, angle, height);
    return perez;
  };
  luminance_ = fit(kLuminance, std::max(0.0, zenith_luminance(light.turbidity, angle)));
  x_ = fit(kX, zenith_chromaticity(kZenithX, light.turbidity, angle));
  y_ = fit(kY, zenith_chromaticity(kZenithY, light.turbidity, angle));
}

Vec3f DaySky::above(const Vec3& d) const {
  const double up = std::max(d.y(), kLowest), cos_sun = std::clamp(d.dot(sun_), -1.0, 1.0);
  const double sun_angle = portable_acos(cos_sun);
  const double luminance = scale_ * luminance_.at(up, sun_angle, cos_sun);
  return linear_srgb(x_.at(up, sun_angle, cos_sun), y_.at(up, sun_angle, cos_sun), luminance);
}

Vec3f DaySky::radiance(const Vec3f& d) const {
  if (d.y() >= 0) return above(d.cast<double>());
  const float t = std::min(-10 * d.y(), 1.f), part = t * t * (3 - 2 * t);  // within 6 degrees
  return part < 1 ? Vec3f((1 - part) * above(d.cast<double>()) + part * ground_) : ground_;
}

}  // namespace firn
