// SPDX-License-Identifier: MIT
// From linear radiance to 8-bit sRGB: exposure -> tone curve -> sRGB transfer -> rounding.
// Sunlit snow spans several stops above middle grey. The soft curve leaves everything up to kShoulder as it
// is, so that surfaces keep the colour they were given, and rolls off above it with an unbroken slope, so
// that bright snow keeps its form instead of clipping to a white patch.
#pragma once
#include <cstdint>
#include <vector>

#include "firn/picture.h"

namespace firn {

struct Image8 {  // sRGB, 3 bytes a pixel, row 0 at the top
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

inline constexpr float kShoulder = 0.5f;

// soft: y = x up to a = kShoulder; above it y = a + (1 - a) (1 - 1 / (1 + t/2)^2), t = (x - a) / (1 - a):
// slope 1 at a, limit 1. srgb: y = x. filmic: y = x (x + 0.1) / (x (x + 0.2644) + 0.2): a toe of slope 1/2,
// 0.18 stays, 1 becomes 0.75, limit 1. All work on each colour alone, so greys stay grey, and are rational on
// purpose: the same bits on every system, which exp() does not promise. Negative and NaN become 0.
float tone_curve(ToneMap map, float linear);

// IEC 61966-2-1 transfer of `linear` in [0, 1], rounded to the nearest of 256 levels.
std::uint8_t srgb8(float linear);
float srgb8_to_linear(std::uint8_t level);

Image8 to_image8(const Picture& picture, const ToneMapping& tone);

}  // namespace firn
