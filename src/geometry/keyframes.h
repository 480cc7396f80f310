// SPDX-License-Identifier: MIT
// A rigid motion given by key frames. In: where a body is at some times, relative to how it was placed. Out:
// its pose at any time and its velocity. Between two keys the shift goes straight and the rotation turns the
// short way about one axis, both evenly; before the first and after the last key the body stands still. All
// of it is a function of time alone, so nothing has to be kept in a checkpoint.
#pragma once
#include <cstdint>
#include <vector>

#include "src/geometry/shape.h"

namespace firn {

Mat3 rotation_by(const Vec3& turn);  // by |turn| (rad) about it

struct MotionKey {
  double time = 0;                   // s
  Vec3 shift = Vec3::Zero();         // m, from the place where the body was put
  Mat3 rotation = Mat3::Identity();  // about the pivot, world axes
};

// Of a rigid body: the velocity of its point x is linear + angular x (x - center).
struct RigidVelocity {
  Vec3 linear = Vec3::Zero();   // m/s, of the pivot
  Vec3 angular = Vec3::Zero();  // rad/s
  Vec3 center = Vec3::Zero();   // m, the pivot now

  Vec3 at(const Vec3& x) const;
  bool is_zero() const { return linear.isZero(0) && angular.isZero(0); }
};

class Motion {
 public:
  Motion() = default;  // none: everything stays where it was put
  // `keys` in ascending order of time. The pivot (m) is where the rotations turn about, before any shift.
  Motion(std::vector<MotionKey> keys, const Vec3& pivot);

  // The same motion in the coordinates of a frame that stands still.
  Motion seen_from(const Pose& frame) const;

  bool empty() const { return keys_.empty(); }
  Pose pose(const Pose& placed, double time) const;

  // The mean over begin..end, begin < end: followed for that long it leads from the pose at the one to the
  // pose at the other, whatever keys lie between (for turns: where they keep their axis). The center is that
  // at the end.
  RigidVelocity velocity(double begin, double end) const;

  // Bounds over begin..end of points no farther than `lever` (m) from the pivot: the greatest speed (m/s),
  // and the longest way (m).
  double top_speed(double begin, double end, double lever) const;
  double longest_way(double begin, double end, double lever) const;

  // m: how far the shape's points lie from the pivot at most; 1e300 where it has no end.
  double lever(const Shape& placed) const;
  Vec3 pivot(double time) const;  // m

  // `before` and all that this motion is, mixed: another motion, another hash.
  std::uint64_t hash(std::uint64_t before) const;

 private:
  struct Segment {
    Vec3 linear, angular;  // m/s, rad/s
  };
  template <class Visit>
  void for_each_overlap(double begin, double end, Visit&& visit) const;
  std::size_t key_before(double time) const;  // the last one not after `time`, or the first

  std::vector<MotionKey> keys_;
  std::vector<Segment> segments_;  // from each key to the next
  Vec3 pivot_ = Vec3::Zero();
};

}  // namespace firn
