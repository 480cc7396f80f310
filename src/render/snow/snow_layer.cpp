// SPDX-License-Identifier: MIT
#include "src/render/snow/snow_layer.h"

#include <algorithm>
#include <cmath>

#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr int kSteps = 256;  // even in depth / (1 + depth), where both change evenly

// sinh(a) / sinh(b) for 0 <= a <= b, without overflow.
double sinh_ratio(double a, double b) {
  if (b < 1e-4) return b > 0 ? a / b : 1;
  return portable_exp(a - b) * (1 - portable_exp(-2 * a)) / (1 - portable_exp(-2 * b));
}

}  // namespace

Vec3 layer_exponent(const SnowLook& look, IceSource ice) {
  const double wavelength[3] = {610, 545, 460};
  Vec3 y;
  for (int c = 0; c < 3; ++c) {
    const double lost = ice_absorption(ice, wavelength[c]) * look.ice_per_collision;
    y[c] = 4 * std::sqrt(lost / (3 * (1 - look.anisotropy)));
  }
  return y;
}

SnowLayer snow_layer(const SnowLook& look, IceSource ice, double transport_depth) {
  const Vec3 exponent = layer_exponent(look, ice);
  SnowLayer layer;
  for (int c = 0; c < 3; ++c) {
    const double y = std::max(exponent[c], 1e-6), x = 0.75 * transport_depth * y;
    layer.reflected[c] = static_cast<float>(sinh_ratio(x, x + y)) * look.albedo[c];
    layer.passed[c] = static_cast<float>(sinh_ratio(y, x + y)) * look.albedo[c];
  }
  return layer;
}

SnowLayers::SnowLayers(std::vector<SnowLook> looks, IceSource ice) {
  if (looks.empty()) looks.emplace_back();
  for (const SnowLook& look : looks) {
    Table table{static_cast<float>(look.extinction * (1 - look.anisotropy)), {}};
    for (int k = 0; k <= kSteps; ++k) {
      const double u = std::min(static_cast<double>(k) / kSteps, 1 - 1e-9);
      table.layers.push_back(snow_layer(look, ice, u / (1 - u)));
    }
    tables_.push_back(std::move(table));
  }
}

SnowLayer SnowLayers::of(std::size_t object, float column) const {
  const Table& table = each(object);
  const float depth = table.per_column * column, at = kSteps * (depth / (1 + depth));
  const int below = std::min(static_cast<int>(at), kSteps - 1);
  const float part = at - static_cast<float>(below);
  const SnowLayer &low = table.layers[below], &high = table.layers[below + 1];
  return {low.reflected + part * (high.reflected - low.reflected),
          low.passed + part * (high.passed - low.passed)};
}

float SnowLayers::transport_path(std::size_t object, float density) const {
  return 1 / (each(object).per_column * density);
}

}  // namespace firn
