// SPDX-License-Identifier: MIT
// A rendered frame: linear light, and layers that tell more of it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "firn/export.h"

namespace firn {

// What a scene's output.layers may name. beauty: the picture itself; albedo, normal (unit, world axes) and
// depth (m) of what is seen first; sparkle and subsurface, the light of glints and of the inside of the snow,
// which the beauty holds too; samples: paths a pixel; variance: of the pixel's luminance.
enum class Layer { beauty, albedo, normal, depth, sparkle, subsurface, samples, variance };
// By their numbers.
inline constexpr const char* kLayerNames[] = {"beauty",  "albedo",     "normal",  "depth",
                                              "sparkle", "subsurface", "samples", "variance"};
// As output.layers has it.
constexpr const char* layer_name(Layer layer) { return kLayerNames[static_cast<int>(layer)]; }

// Values a pixel: 3 for colours and normals, else 1.
constexpr int channels_of(Layer layer) {
  return layer == Layer::depth || layer == Layer::samples || layer == Layer::variance ? 1 : 3;
}

// One layer of a picture.
struct LayerImage {
  Layer layer = Layer::beauty;  // which it is
  std::vector<float> values;    // shape (height, width, channels_of(layer))
};

// A value: copies are independent. Row 0 is at the top.
struct Picture {
  int width = 0;   // pixels
  int height = 0;  // pixels
  // Radiance, linear RGB (primaries of sRGB), without exposure; shape (height, width, 3).
  std::vector<float> rgb;
  std::vector<LayerImage> layers;  // those that the scene asks for, beside the beauty

  // Black, of this size, in pixels.
  void resize(int w, int h) {
    width = w;
    height = h;
    rgb.assign(static_cast<std::size_t>(w) * h * 3, 0.f);
  }
  // The three values of a pixel, 0 <= x < width, 0 <= y < height.
  float* pixel(int x, int y) { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
  const float* pixel(int x, int y) const { return &rgb[3 * (static_cast<std::size_t>(y) * width + x)]; }
};

// How light becomes 8 bits: soft leaves the dark half as it is and rolls off above it, srgb clips, filmic has
// a toe and a shoulder.
enum class ToneMap { soft, srgb, filmic };

// How a picture is shown.
struct ToneMapping {
  double exposure = 0;            // stops: radiance is multiplied by 2^exposure first
  ToneMap curve = ToneMap::soft;  // and then mapped so
};

// The picture as a screen shows it: sRGB, 3 bytes a pixel, shape (height, width, 3).
FIRN_API std::vector<std::uint8_t> tone_mapped(const Picture& picture, const ToneMapping& tone = {});

// As the file's name ends: .png or .ppm with tone mapping; .pfm or .exr in linear 32-bit floats, with the
// layers (.pfm: a file each, "name.depth.pfm"). A file that is there is replaced at once. Returns the files
// that were written. Errors: usage Error for another ending, or .exr where firn was built without OpenEXR; io
// Error.
FIRN_API std::vector<std::string> write_picture(const Picture& picture, const std::string& file,
                                                const ToneMapping& tone = {});

}  // namespace firn
