// SPDX-License-Identifier: MIT
// The camera: film points -> rays, and points of the scene -> film points, so that light can also come upon
// the camera by itself. A pinhole, or a thin lens that is sharp in one plane. Both ways place a point of the
// lens evenly on its disc, so that the lens' own density is the same for all strategies and cancels.
#pragma once
#include "kernels/shade/table.h"
#include "src/geometry/keyframes.h"
#include "src/render/film/filter.h"
#include "src/render/sampling/sampler.h"
#include "src/render/setup.h"

namespace firn {

struct CameraRay {
  Vec3f origin, direction;  // render space, m; unit
};

struct CameraSight {  // the camera, seen from a point
  Vec3f direction;    // unit, towards the lens
  float distance;     // m
  float x, y;         // film, pixels: pixel (i, j) spans [i, i + 1) x [j, j + 1), row 0 at the top
  float cosine;       // at the lens
};

class CameraRays {
 public:
  // A usage Error if the camera looks nowhere (at any key frame) or the film has no pixels.
  CameraRays(const Camera& camera, const ImageSettings& image);

  // Render space is world space minus `origin`; the camera is where its key frames have it at `time` (s). A
  // usage Error if it looks nowhere there.
  void place(const Vec3& origin, double time);

  const PixelFilter& filter() const { return filter_; }

  // Through pixel (x, y), displaced within the pixel filter by `film`, from a point of the lens.
  CameraRay ray(int x, int y, Sample2 film, Sample2 lens) const;

  // Through the middle of a pixel, from the middle of the lens. Many at once: ShadeKernels::sights.
  CameraRay middle_ray(int x, int y) const;
  Vec3f eye() const { return eye_.cast<float>(); }  // render space
  kernels::Pinhole pinhole() const;

  // The sight of the camera's lens from p (render space). False if p is not in the picture: behind the
  // camera, or farther off the film than the pixel filter reaches.
  bool see(const Vec3f& p, Sample2 lens, CameraSight& out) const;

  // Pixels^2 of film for each solid angle (sr) about a camera ray of that direction; 0 behind the camera. A
  // ray that left a pixel through a lens always lies on the film, so the film's edge is see()'s alone.
  float film_density(const Vec3f& direction) const;

 private:
  Vec3 lens_point(Sample2 lens) const;

  Camera camera_;
  Motion positions_, targets_;
  PixelFilter filter_;
  double width_, height_, center_x_, center_y_;  // pixels
  double pixel_;                                 // side of a pixel at distance 1
  Vec3 eye_;                                     // render space
  Vec3 forward_, right_, down_;                  // unit
  double focus_ = 1;                             // m, of the plane that is sharp
};

}  // namespace firn
