// SPDX-License-Identifier: MIT
// Everything that is seen but is not snow: rays against shapes, in double, in each shape's own frame (so that
// a shape is as exact far from the world's origin as near it).
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "firn/driver.h"
#include "kernels/trace/table.h"
#include "src/render/setup.h"
#include "src/render/snow/surface_area.h"
#include "src/render/solids/scattering.h"
#include "src/render/solids/triangles.h"

namespace firn {

struct ObjectHit {
  int object = -1;               // none
  float t = 0;                   // m
  Vec3f normal = Vec3f::Zero();  // unit, outward
  Vec3f albedo = Vec3f::Zero();  // of the surface there
};

class ObjectSet {
 public:
  // A usage Error if an object names a surface that does not exist.
  ObjectSet(const kernels::TraceKernels& kernels, std::vector<Object> objects, std::vector<Surface> surfaces);

  // Render space is world space minus `origin`; objects that move are where they are at `time` (s), driven
  // ones where these are, going on evenly from their own time.
  void place(const Vec3& origin, double time = 0, std::span<const DrivenCollider> driven = {});

  bool empty() const { return objects_.empty(); }
  int count() const { return static_cast<int>(objects_.size()); }
  const Surface& surface(int object) const { return surfaces_[objects_[object].surface]; }
  const Shape& shape(int object) const { return objects_[object].shape; }  // as it was placed in the world
  const Pose& pose(int object) const { return pose_[object]; }             // render space, now
  Bounds bounds(int object) const;                                         // m, world space, now
  std::shared_ptr<const SurfaceArea> area(int object) const;

  SurfacePoint point(const ObjectHit& hit) const;

  // The nearest object that the ray meets before `reach`.
  ObjectHit closest(const Vec3f& o, const Vec3f& d, float reach) const;
  // Surfaces that let light straight on hide nothing.
  bool occluded(const Vec3f& o, const Vec3f& d, float reach) const;
  // False if no object has a point in the box.
  bool may_reach(const Vec3f& low, const Vec3f& high) const;

 private:
  // Where an object is at most, render space: most rays in snow end long before they could meet it.
  struct Room {
    Vec3f low, high;  // m, of its box; of a half space all
    Vec3f normal;     // of a half space, whose points have normal . p <= offset; else 0
    float offset = 0;

    bool beyond(const Vec3f& o, float reach) const {
      if (normal.squaredNorm() > 0) return normal.dot(o) - offset > reach;
      const Vec3f apart = (low - o).cwiseMax(o - high).cwiseMax(0.f);
      return apart.squaredNorm() > reach * reach;
    }
    bool apart(const Vec3f& other_low, const Vec3f& other_high) const {
      if (normal.squaredNorm() > 0) {
        const Vec3f nearest = (normal.array() > 0).select(other_low, other_high);
        return normal.dot(nearest) > offset;
      }
      return (other_low.array() > high.array()).any() || (low.array() > other_high.array()).any();
    }
  };

  double intersect(std::size_t object, const Vec3& o, const Vec3& d, double limit, Vec3& normal) const;
  bool blocks(std::size_t object, const Vec3& o, const Vec3& d, double limit) const;
  Vec3f albedo_at(int object, const Vec3& local, const Vec3& normal) const;

  const kernels::TraceKernels& kernels_;
  std::vector<Object> objects_;
  std::vector<Surface> surfaces_;
  std::vector<std::shared_ptr<const TriangleSet>> triangles_;  // per object; empty for analytic shapes
  std::vector<Pose> world_pose_;                               // now
  std::vector<Pose> pose_;                                     // render space
  std::vector<Room> room_;
};

}  // namespace firn
