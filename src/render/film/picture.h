// SPDX-License-Identifier: MIT
// A finished frame: linear RGB, no exposure applied, and layers that tell more of it. Row 0 is at the top.
#pragma once
#include <cstddef>
#include <vector>

namespace firn {

enum class Layer { beauty, albedo, normal, depth, sparkle, subsurface, samples, variance };
inline constexpr const char* kLayerNames[] = {"beauty",  "albedo",     "normal",  "depth",
                                              "sparkle", "subsurface", "samples", "variance"};
constexpr const char* layer_name(Layer layer) { return kLayerNames[static_cast<int>(layer)]; }

// 3 for colours and normals, else 1.
constexpr int channels_of(Layer layer) {
  return layer == Layer::depth || layer == Layer::samples || layer == Layer::variance ? 1 : 3;
}

enum class ToneMap { soft, srgb, filmic };  // how light becomes 8 bits: src/io/tone.h

struct LayerImage {
  Layer layer = Layer::beauty;
  std::vector<float> values;  // channels_of(layer) a pixel
};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;          // 3 a pixel
  std::vector<LayerImage> layers;  // those asked for, beside the beauty

  void resize(int w, int h) {
    width = w;
    height = h;
    rgb.assign(static_cast<std::size_t>(w) * h * 3, 0.f);
  }
  float* pixel(int x, int y) { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
  const float* pixel(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

}  // namespace firn
