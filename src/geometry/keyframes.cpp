// SPDX-License-Identifier: MIT
#include "src/geometry/keyframes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "src/core/portable_math.h"
#include "src/core/rng.h"

namespace firn {

// Rodrigues.
Mat3 rotation_by(const Vec3& turn) {
  const double angle = turn.norm();
  if (!(angle > 0)) return Mat3::Identity();
  const Vec3 axis = turn / angle;
  const SinCos a = portable_sincos(angle);
  Mat3 across;
  across << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return a.cos * Mat3::Identity() + a.sin * across + (1 - a.cos) * (axis * axis.transpose());
}

namespace {

// The short way from one orientation to another, as axis times angle, world axes.
Vec3 turn_between(const Mat3& from, const Mat3& to) {
  if (from == to) return Vec3::Zero();
  const Eigen::AngleAxisd turn(Mat3(to * from.transpose()));
  return turn.angle() * turn.axis();
}

}  // namespace

Vec3 RigidVelocity::at(const Vec3& x) const { return linear + angular.cross(x - center); }

Motion::Motion(std::vector<MotionKey> keys, const Vec3& pivot) : keys_(std::move(keys)), pivot_(pivot) {
  for (std::size_t k = 0; k + 1 < keys_.size(); ++k) {
    const MotionKey &a = keys_[k], &b = keys_[k + 1];
    const double seconds = b.time - a.time;
    segments_.push_back({(b.shift - a.shift) / seconds, turn_between(a.rotation, b.rotation) / seconds});
  }
}

Motion Motion::seen_from(const Pose& frame) const {
  if (empty()) return {};
  const Mat3 to_local = frame.rotation.transpose();
  std::vector<MotionKey> keys;
  for (const MotionKey& key : keys_) {
    keys.push_back({key.time, to_local * key.shift, to_local * key.rotation * frame.rotation});
  }
  return {std::move(keys), frame.to_local(pivot_)};
}

std::size_t Motion::key_before(double time) const {
  const auto after = std::upper_bound(keys_.begin(), keys_.end(), time,
                                      [](double t, const MotionKey& key) { return t < key.time; });
  return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - keys_.begin() - 1, 0));
}

Vec3 Motion::pivot(double time) const {
  if (keys_.empty()) return pivot_;
  const std::size_t k = key_before(time);
  const double since = time - keys_[k].time;
  const bool between = since > 0 && k < segments_.size();
  return pivot_ + keys_[k].shift + (between ? Vec3(since * segments_[k].linear) : Vec3::Zero());
}

Pose Motion::pose(const Pose& placed, double time) const {
  if (keys_.empty()) return placed;
  const std::size_t k = key_before(time);
  const double since = time - keys_[k].time;
  Mat3 rotation = keys_[k].rotation;
  if (since > 0 && k < segments_.size()) rotation = rotation_by(since * segments_[k].angular) * rotation;
  return {rotation * placed.rotation, pivot(time) + rotation * (placed.translation - pivot_)};
}

// visit(segment, seconds) for the parts of begin..end that lie between keys.
template <class Visit>
void Motion::for_each_overlap(double begin, double end, Visit&& visit) const {
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    const double seconds = std::min(end, keys_[k + 1].time) - std::max(begin, keys_[k].time);
    if (seconds > 0) visit(segments_[k], seconds);
  }
}

RigidVelocity Motion::velocity(double begin, double end) const {
  RigidVelocity mean;
  if (keys_.empty()) return mean;
  for_each_overlap(begin, end, [&](const Segment& s, double seconds) {
    mean.linear += seconds * s.linear;
    mean.angular += seconds * s.angular;
  });
  mean.linear /= end - begin;
  mean.angular /= end - begin;
  mean.center = pivot(end);
  return mean;
}

double Motion::top_speed(double begin, double end, double lever) const {
  double speed = 0;
  for_each_overlap(begin, end, [&](const Segment& s, double) {
    const double turning = s.angular.norm();
    speed = std::max(speed, s.linear.norm() + (turning > 0 ? turning * lever : 0));
  });
  return speed;
}

double Motion::longest_way(double begin, double end, double lever) const {
  double way = 0;
  for_each_overlap(begin, end, [&](const Segment& s, double seconds) {
    const double turning = s.angular.norm();
    way += seconds * (s.linear.norm() + (turning > 0 ? turning * lever : 0));
  });
  return way;
}

double Motion::lever(const Shape& placed) const {
  if (std::holds_alternative<HalfSpace>(placed.form)) return 1e300;
  const Bounds bounds = world_bounds(placed);
  return (bounds.max - pivot_).cwiseAbs().cwiseMax((bounds.min - pivot_).cwiseAbs()).norm();
}

std::uint64_t Motion::hash(std::uint64_t before) const {
  std::uint64_t h = hash_keys(before, keys_.size());
  const auto mix = [&h](double value) { h = hash_keys(h, key_of(value)); };
  for (const double x : pivot_) mix(x);
  for (const MotionKey& key : keys_) {
    mix(key.time);
    for (const double x : key.shift) mix(x);
    for (const double x : key.rotation.reshaped()) mix(x);
  }
  return h;
}

}  // namespace firn
