// SPDX-License-Identifier: MIT
// The transfer is done by search among the 255 linear values where the rounded level changes: exact rounding,
// and one table instead of a pow() for each of a million samples.
#include "src/io/tone.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace firn {
namespace {

double srgb_to_linear(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

std::array<float, 255> make_level_edges() {
  std::array<float, 255> edges{};
  for (int level = 0; level < 255; ++level)
    edges[level] = static_cast<float>(srgb_to_linear((level + 0.5) / 255.0));
  return edges;
}

}  // namespace

float tone_curve(ToneMap map, float linear) {
  if (!(linear > 0.f)) return 0.f;
  if (map == ToneMap::srgb) return linear;
  if (map == ToneMap::filmic) {
    const float x = std::min(linear, 1e6f);
    return x * (x + 0.1f) / (x * (x + 0.26444444f) + 0.2f);
  }
  if (linear <= kShoulder) return linear;
  const float t = (linear - kShoulder) / (1.f - kShoulder);
  const float fall = 1.f / (1.f + 0.5f * t);
  return kShoulder + (1.f - kShoulder) * (1.f - fall * fall);
}

std::uint8_t srgb8(float linear) {
  static const std::array<float, 255> kEdges = make_level_edges();
  return static_cast<std::uint8_t>(std::upper_bound(kEdges.begin(), kEdges.end(), linear) - kEdges.begin());
}

float srgb8_to_linear(std::uint8_t level) { return static_cast<float>(srgb_to_linear(level / 255.0)); }

Image8 to_image8(const Picture& picture, const ToneMapping& tone) {
  const auto gain = static_cast<float>(std::exp2(tone.exposure));
  Image8 image{picture.width, picture.height, std::vector<std::uint8_t>(picture.rgb.size())};
  std::transform(picture.rgb.begin(), picture.rgb.end(), image.rgb.begin(),
                 [&](float linear) { return srgb8(tone_curve(tone.curve, gain * linear)); });
  return image;
}

}  // namespace firn
