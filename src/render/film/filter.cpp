// SPDX-License-Identifier: MIT
#include "src/render/film/filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr int kSteps = 64;

double default_width(FilterKind kind) {
  if (kind == FilterKind::box) return 1;
  return kind == FilterKind::tent ? 2 : 3;
}

// At r = |offset| / radius, up to a factor.
double curve(FilterKind kind, double r) {
  switch (kind) {
    case FilterKind::box:
      return 1;
    case FilterKind::tent:
      return 1 - r;
    case FilterKind::gaussian:
      return portable_exp(-4.5 * r * r) - portable_exp(-4.5);
    default:
      return 0.35875 + 0.48829 * portable_sincos(std::numbers::pi * r).cos +
             0.14128 * portable_sincos(2 * std::numbers::pi * r).cos +
             0.01168 * portable_sincos(3 * std::numbers::pi * r).cos;
  }
}

}  // namespace

PixelFilter::PixelFilter(FilterKind kind, std::optional<double> width)
    : radius_(0.5 * width.value_or(default_width(kind))) {
  const bool straight = kind == FilterKind::box || kind == FilterKind::tent;
  const int steps = straight ? 1 : kSteps;
  for (int i = 0; i <= steps; ++i) height_.push_back(curve(kind, static_cast<double>(i) / steps));
  below_.push_back(0);
  for (int i = 0; i < steps; ++i) {
    below_.push_back(below_.back() + 0.5 * (height_[i] + height_[i + 1]) * radius_ / steps);
  }
  const double scale = 0.5 / below_.back();
  for (double& h : height_) h *= scale;
  for (double& b : below_) b *= scale;
}

double PixelFilter::density(double offset) const {
  const double steps = static_cast<double>(height_.size() - 1), at = std::fabs(offset) / radius_ * steps;
  if (!(at < steps)) return 0;
  const auto i = static_cast<std::size_t>(at);
  return height_[i] + (at - static_cast<double>(i)) * (height_[i + 1] - height_[i]);
}

// Inverts the integral: a x + (b - a) x^2 / (2 l) = what is missing, in the step where it is reached.
double PixelFilter::sample(float u) const {
  const double side = u < 0.5f ? -1 : 1, wanted = side * (static_cast<double>(u) - 0.5);
  const auto above = std::upper_bound(below_.begin() + 1, below_.end() - 1, wanted);
  const auto i = static_cast<std::size_t>(above - below_.begin() - 1);
  const double step = radius_ / static_cast<double>(height_.size() - 1);
  const double a = height_[i], b = height_[i + 1], p = wanted - below_[i];
  const double root = std::sqrt(std::max(a * a + 2 * (b - a) * p / step, 0.0));
  const double x = a + root > 0 ? 2 * p / (a + root) : 0;
  return side * (static_cast<double>(i) * step + std::min(x, step));
}

}  // namespace firn
