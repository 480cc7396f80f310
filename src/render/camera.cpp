// SPDX-License-Identifier: MIT
#include "src/render/camera.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "firn/error.h"
#include "src/core/portable_math.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

[[noreturn]] void refuse(const char* where, const char* what) { throw Error(ErrorCode::usage, where, what); }

void check_sight(const Vec3& position, const Vec3& target, const Vec3& up) {
  const Vec3 view = target - position;
  if (!(view.norm() > 0) || !view.allFinite()) {
    refuse("camera", "position and target are the same point: it looks nowhere");
  }
  if (!(view.cross(up).norm() > 1e-9 * view.norm() * up.norm())) {
    refuse("camera", "up is along the line of sight; choose another direction");
  }
}

// One of the two tracks of the key frames; empty without any.
Motion track(const Camera& camera, Vec3 CameraKey::*point) {
  std::vector<MotionKey> keys;
  if (camera.motion) {
    for (const CameraKey& key : *camera.motion) keys.push_back({key.time, key.*point});
  }
  return {std::move(keys), Vec3::Zero()};
}

}  // namespace

CameraRays::CameraRays(const Camera& camera, const ImageSettings& image)
    : camera_(camera),
      positions_(track(camera, &CameraKey::position)),
      targets_(track(camera, &CameraKey::target)),
      filter_(image.filter, image.filter_width),
      width_(image.width),
      height_(image.height),
      center_x_(0.5 * image.width),
      center_y_(0.5 * image.height) {
  if (!(camera.fov > 0 && camera.fov < 180)) refuse("camera", "fov must lie between 0 and 180 degrees");
  if (!(camera.aperture >= 0) || !(camera.focus.value_or(1) > 0)) {
    refuse("camera", "aperture must be at least 0 and focus above 0");
  }
  if (image.width < 1 || image.height < 1 || image.samples < 1 || image.max_bounces < 0) {
    refuse("image", "width, height and samples must be at least 1, max_bounces at least 0");
  }
  if (!(filter_.radius() > 0)) refuse("image", "filter_width must be above 0");
  const SinCos half = portable_sincos(0.5 * camera.fov * kDegree);
  pixel_ = 2 * half.sin / half.cos / image.height;
  if (camera.motion) {
    for (const CameraKey& key : *camera.motion) check_sight(key.position, key.target, camera.up);
  }
  place(Vec3::Zero(), 0);
}

void CameraRays::place(const Vec3& origin, double time) {
  const Vec3 position = positions_.empty() ? camera_.position : positions_.pivot(time);
  const Vec3 target = targets_.empty() ? camera_.target : targets_.pivot(time);
  check_sight(position, target, camera_.up);
  const Vec3 view = target - position;
  eye_ = position - origin;
  forward_ = view.normalized();
  right_ = view.cross(camera_.up).normalized();
  down_ = forward_.cross(right_);
  focus_ = camera_.focus.value_or(view.norm());
}

Vec3 CameraRays::lens_point(Sample2 lens) const {
  if (camera_.aperture == 0) return eye_;
  const Disc disc = on_circle(std::sqrt(lens.u), lens.v);
  return eye_ + camera_.aperture * (disc.x * right_ + disc.y * down_);
}

CameraRay CameraRays::ray(int x, int y, Sample2 film, Sample2 lens) const {
  const double px = x + 0.5 + filter_.sample(film.u) - center_x_;
  const double py = y + 0.5 + filter_.sample(film.v) - center_y_;
  const Vec3 through = forward_ + pixel_ * (px * right_ + py * down_);
  if (camera_.aperture == 0) return {eye_.cast<float>(), through.normalized().cast<float>()};
  const Vec3 start = lens_point(lens);
  return {start.cast<float>(), (eye_ + focus_ * through - start).normalized().cast<float>()};
}

CameraRay CameraRays::middle_ray(int x, int y) const {
  const Vec3 through = forward_ + pixel_ * ((x + 0.5 - center_x_) * right_ + (y + 0.5 - center_y_) * down_);
  return {eye_.cast<float>(), through.normalized().cast<float>()};
}

kernels::Pinhole CameraRays::pinhole() const {
  kernels::Pinhole pinhole{{}, {}, {}, {center_x_, center_y_}, pixel_};
  for (int a = 0; a < 3; ++a)
    pinhole.forward[a] = forward_[a], pinhole.right[a] = right_[a], pinhole.down[a] = down_[a];
  return pinhole;
}

bool CameraRays::see(const Vec3f& p, Sample2 lens, CameraSight& out) const {
  const Vec3 start = lens_point(lens), away = p.cast<double>() - start;
  const double depth = away.dot(forward_);
  if (!(depth > 0)) return false;
  // Where the line crosses the sharp plane, as seen from the middle of the lens.
  const Vec3 sharp = start - eye_ + (focus_ / depth) * away;
  const double x = sharp.dot(right_) / (focus_ * pixel_) + center_x_;
  const double y = sharp.dot(down_) / (focus_ * pixel_) + center_y_;
  const double reach = filter_.radius();
  if (!(x > -reach && x < width_ + reach && y > -reach && y < height_ + reach)) return false;
  const double distance = away.norm();
  out.direction = (away / -distance).cast<float>();
  out.distance = static_cast<float>(distance);
  out.x = static_cast<float>(x);
  out.y = static_cast<float>(y);
  out.cosine = static_cast<float>(depth / distance);
  return true;
}

float CameraRays::film_density(const Vec3f& direction) const {
  const double cosine = direction.cast<double>().dot(forward_);
  if (!(cosine > 0)) return 0;
  return static_cast<float>(1 / (pixel_ * pixel_ * cosine * cosine * cosine));
}

}  // namespace firn
