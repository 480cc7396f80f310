// SPDX-License-Identifier: MIT
// Pixel filters: how a pixel weighs the light about its centre. Each is a product of one curve across and the
// same down. Eye paths are placed by importance (a sample belongs to one pixel and counts fully), light that
// comes upon the film by itself is weighed by the curve; both follow the very same density, so that the two
// kinds of light add up to one filtered picture.
#pragma once
#include <vector>

#include "src/render/setup.h"

namespace firn {

class PixelFilter {
 public:
  // width: from end to end, pixels; absent: 1 for a box, 2 for a tent, 3 for the others. gaussian: sigma is a
  // sixth of the width, lowered so that it ends at 0. blackman_harris: the window of four terms (Harris
  // 1978).
  explicit PixelFilter(FilterKind kind = FilterKind::tent, std::optional<double> width = {});

  double radius() const { return radius_; }  // pixels
  double sample(float u) const;              // [0, 1) -> offset in pixels, with density()
  double density(double offset) const;       // 1/pixel; its integral over -radius..radius is 1

 private:
  double radius_;
  std::vector<double> height_;  // 1/pixel, at even steps from 0 to the radius; linear in between
  std::vector<double> below_;   // the integral from 0 to each step
};

}  // namespace firn
