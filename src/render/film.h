// SPDX-License-Identifier: MIT
// A finished frame: linear RGB, row 0 at the top, 3 floats a pixel, no exposure applied.
#pragma once
#include <cstddef>
#include <vector>

namespace firn {

struct Film {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;

  void resize(int w, int h) {
    width = w;
    height = h;
    rgb.assign(static_cast<std::size_t>(w) * h * 3, 0.f);
  }
  float* pixel(int x, int y) { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
  const float* pixel(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

}  // namespace firn
