// SPDX-License-Identifier: MIT
#include "src/render/camera.h"

#include <Eigen/Geometry>
#include <cmath>

#include "src/core/error.h"
#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

// Inverse of the tent's distribution function: [0, 1) -> (-1, 1).
double tent(double u) { return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u); }

}  // namespace

CameraRays::CameraRays(const Camera& camera, const ImageSettings& image)
    : position_(camera.position), center_x_(0.5 * image.width), center_y_(0.5 * image.height) {
  const Vec3 view = camera.target - camera.position;
  const Vec3 side = view.cross(camera.up);
  if (!(view.norm() > 0) || !view.allFinite()) {
    throw Error(ExitCode::usage, "camera", "position and target are the same point: it looks nowhere");
  }
  if (!(side.norm() > 1e-9 * view.norm() * camera.up.norm())) {
    throw Error(ExitCode::usage, "camera", "up is along the line of sight; choose another direction");
  }
  if (!(camera.fov > 0 && camera.fov < 180)) {
    throw Error(ExitCode::usage, "camera", "fov must lie between 0 and 180 degrees");
  }
  if (image.width < 1 || image.height < 1 || image.samples < 1 || image.max_bounces < 0) {
    throw Error(ExitCode::usage, "image",
                "width, height and samples must be at least 1, max_bounces at least 0");
  }
  const SinCos half = portable_sincos(0.5 * camera.fov * kDegree);
  const double pixel = 2 * half.sin / half.cos / image.height;
  forward_ = view.normalized();
  right_ = side.normalized() * pixel;
  down_ = forward_.cross(side.normalized()) * pixel;
}

Vec3f CameraRays::direction(int x, int y, Sample2 at) const {
  const double px = x + 0.5 + tent(at.u) - center_x_, py = y + 0.5 + tent(at.v) - center_y_;
  return (forward_ + px * right_ + py * down_).normalized().cast<float>();
}

}  // namespace firn
