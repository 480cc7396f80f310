// SPDX-License-Identifier: MIT
// A picture that things wear or that lights are: linear RGB, row 0 at the top.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "src/core/vector.h"

namespace firn {

struct ImageTexture {
  int width = 0;
  int height = 0;
  std::vector<Vec3f> rgb;

  const Vec3f& pixel(int x, int y) const { return rgb[static_cast<std::size_t>(y) * width + x]; }

  // Bilinear between the middles of pixels at (u, v) in units of the picture, v downwards. It repeats along
  // u; along v it repeats too, or (`tall`) its first and last rows go on.
  Vec3f at(double u, double v, bool tall) const {
    const double x = (u - std::floor(u)) * width - 0.5;
    const double y = (tall ? std::clamp(v, 0.0, 1.0) : v - std::floor(v)) * height - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const auto fx = static_cast<float>(x - left), fy = static_cast<float>(y - top);
    const auto column = [this](int i) { return i < 0 ? i + width : i < width ? i : i - width; };
    const auto row = [this, tall](int j) {
      return tall ? std::clamp(j, 0, height - 1) : j < 0 ? j + height : j < height ? j : j - height;
    };
    const int x0 = column(static_cast<int>(left)), x1 = column(static_cast<int>(left) + 1);
    const int y0 = row(static_cast<int>(top)), y1 = row(static_cast<int>(top) + 1);
    return (1 - fy) * ((1 - fx) * pixel(x0, y0) + fx * pixel(x1, y0)) +
           fy * ((1 - fx) * pixel(x0, y1) + fx * pixel(x1, y1));
  }
};

}  // namespace firn
