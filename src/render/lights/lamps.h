// SPDX-License-Identifier: MIT
// The lights that are somewhere: quads, balls and the surfaces of glowing objects. Each says where on it
// light starts, and how a point is sampled that another one sees. Render space.
#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <variant>

#include "src/geometry/shape.h"
#include "src/render/sampling/sampler.h"
#include "src/render/setup.h"
#include "src/render/snow/surface_area.h"

namespace firn {

using Box3f = Eigen::AlignedBox3f;

struct LampPoint {
  Vec3f p, normal;  // unit, on the side that shines
};

// A point of a lamp as another one sees it.
struct LampSight {
  Vec3f direction;  // unit, towards the lamp
  float distance;   // m
  float cosine;     // at the lamp
  float pdf;        // per solid angle
};

struct LampGlow {
  Vec3f radiance = Vec3f::Zero();
  float area = 0;      // m^2, that is sampled; 0: none
  float strength = 0;  // of the radiance, channels summed
};

class QuadLamp : public LampGlow {
 public:
  explicit QuadLamp(const QuadLight& light);
  void place(const Vec3& origin);

  // Of what it could send to p: an upper estimate, only 0 where it cannot be seen.
  float weight(const Vec3f& p) const;
  bool toward(const Vec3f& p, Sample2 at, LampSight& out) const;
  float density(const Vec3f& p, float distance, float cosine) const;  // of toward()
  LampPoint point(Sample2 at) const;                                  // even over the area
  bool hit(const Vec3f& o, const Vec3f& d, float& t, float& cosine) const;
  Box3f box() const;  // that holds it

 private:
  Vec3 corner_;  // m, world
  Vec3f p_, u_, v_, normal_;
};

class BallLamp : public LampGlow {
 public:
  explicit BallLamp(const SphereLight& light);
  void place(const Vec3& origin);

  float weight(const Vec3f& p) const;
  bool toward(const Vec3f& p, Sample2 at, LampSight& out) const;
  float density(const Vec3f& p, float distance, float cosine) const;
  LampPoint point(Sample2 at) const;
  bool hit(const Vec3f& o, const Vec3f& d, float& t, float& cosine) const;
  Box3f box() const;

 private:
  Vec3 center_;  // m, world
  Vec3f p_;
  float radius_;
};

class ObjectLamp : public LampGlow {
 public:
  ObjectLamp(std::shared_ptr<const SurfaceArea> surface, const Vec3f& radiance);
  // `center` (render space) tells which side is sampled.
  void place(const Pose& pose, const Shape& shape, const Vec3& center);

  bool inward() const { return inward_; }
  float weight(const Vec3f& p) const;
  bool toward(const Vec3f& p, Sample2 at, LampSight& out) const;
  float density(const Vec3f& p, float distance, float cosine) const;
  LampPoint point(Sample2 at) const;
  bool hit(const Vec3f&, const Vec3f&, float&, float&) const { return false; }  // ObjectSet meets it
  Box3f box() const { return {}; }                                              // and knows where it is

 private:
  std::shared_ptr<const SurfaceArea> surface_;
  Pose pose_;
  Vec3f middle_ = Vec3f::Zero();
  float radius_ = 0;  // of a ball about the middle that holds it
  bool inward_ = false;
};

using Lamp = std::variant<QuadLamp, BallLamp, ObjectLamp>;

}  // namespace firn
