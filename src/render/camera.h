// SPDX-License-Identifier: MIT
// A pinhole camera: film points -> directions. The pixel filter is a tent of one pixel's half width, sampled
// by importance, so that a sample belongs to one pixel alone and tiles never share one.
#pragma once
#include "src/render/sampler.h"
#include "src/render/setup.h"

namespace firn {

class CameraRays {
 public:
  // A usage Error if the camera looks nowhere or the film has no pixels.
  CameraRays(const Camera& camera, const ImageSettings& image);

  Vec3 position() const { return position_; }  // m, world
  // Unit direction through pixel (x, y), row 0 at the top, displaced within the filter by `at`.
  Vec3f direction(int x, int y, Sample2 at) const;

 private:
  Vec3 position_, forward_, right_, down_;  // right_ and down_ span a pixel at distance 1
  double center_x_, center_y_;              // pixels
};

}  // namespace firn
