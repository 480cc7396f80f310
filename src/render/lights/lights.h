// SPDX-License-Identifier: MIT
// The light sources, as the two ends of a path need them: from a point that is lit (sample, pdf), from the
// light itself (emit) and from a ray that comes upon one (hit, object_hit, escape). Everything at infinity
// (suns, skies, pictures, constant light) acts as one light: its radiance in a direction is the sum, its
// density the mixture. So whichever way a path is found, all densities that its weights need are there.
// Quads, balls and glowing objects are sampled evenly over their area (balls seen from a point: over the cone
// that they fill).
//
// A quad shines to one side. A glowing object glows to both, but only the side that the scene's centre lies
// on is sampled; the other side and glowing planes, which have no end, are found by rays that meet them:
// their densities are 0.
#pragma once
#include <variant>
#include <vector>

#include "src/render/columns/ray_stream.h"
#include "src/render/lights/lamps.h"
#include "src/render/lights/sky.h"
#include "src/render/sampling/sampler.h"
#include "src/render/setup.h"
#include "src/render/solids/objects.h"

namespace firn {

// A point of a light, seen from a point that it may light.
struct LightSample {
  Vec3f direction;     // unit, towards the light
  float distance = 0;  // m; infinite for lights at infinity
  Vec3f radiance;      // that arrives unhindered
  float pdf = 0;       // per solid angle at the receiver, the choice of the light included
  float pdf_emit = 0;  // with which emit() starts this very ray: choice x area x solid angle, 1/(m^2 sr)
  float cosine = 1;    // at the light; 1 at infinity
};

// The start of a light subpath.
struct Emission {
  Vec3f origin, direction;  // render space, unit
  Vec3f radiance;
  float pdf_emit = 0;   // as above
  float pdf_start = 0;  // choice x density of the start: per area (1/m^2); at infinity per solid angle (1/sr)
  float cosine = 1;     // at the light; 1 at infinity
  int light = 0;        // as LightHit
  bool distant = false;  // `origin` lies on a disc before the scene
};

// What a ray meets when it comes upon a light.
struct LightHit {
  int light = 0;
  Vec3f radiance = Vec3f::Zero();
  float pdf_emit = 0;
  float cosine = 1;
};

class LightSet {
 public:
  // `objects` live as long as this and are placed before it.
  LightSet(const std::vector<Light>& lights, const ObjectSet& objects);

  // Render space is world space minus `origin` (m). Light from infinity starts on discs as wide as the ball
  // (center, radius; m, render space), which should hold all that the light could reach.
  void place(const Vec3& origin, const Vec3& center, float radius);

  // A light, chosen by what it could send to `p` unhindered, and a point of it. False if none is seen from
  // there.
  bool sample(const Vec3f& p, float choice, Sample2 at, LightSample& out) const;

  // The same for all points at once, as far as the way goes: directions (unit; to rounding those of sample())
  // and distances from `rays`' origins, 0 where sample() is false.
  void aim(const kernels::ShadeKernels& with, const float* choice, const float* u, const float* v,
           RayStream& rays) const;

  // For who wants light without noise: lamps and suns by number, each by its middle. middle() is what
  // sample() would be if the light were alone and its middle stood for all of it, so radiance / pdf is what
  // it sends to a plane that faces it; 1 / pdf is the solid angle that it fills.
  int beacons() const { return static_cast<int>(lamps_.size() + suns_.size()); }
  bool middle(int beacon, const Vec3f& p, LightSample& out) const;

  // The density with which sample() takes the direction of a ray from `p` that came upon a light.
  float pdf(const Vec3f& p, const Vec3f& direction, float distance, const LightHit& hit) const;

  // A light, chosen by its power, and a ray that it sends out. False if there is no light.
  bool emit(float choice, Sample2 place, Sample2 direction, Emission& out) const;

  bool any_lamps() const { return !lamps_.empty(); }  // quads, balls, objects that glow

  // The nearest quad or ball that a ray meets before `t`, which is shortened.
  bool hit(const Vec3f& o, const Vec3f& d, float& t, LightHit& out) const;

  // False if no quad or ball has a point in the box.
  bool may_reach(const Vec3f& low, const Vec3f& high) const;

  // The ray met an object: false if it does not glow.
  bool object_hit(int object, const Vec3f& d, const ObjectHit& met, LightHit& out) const;

  // What a ray that leaves the scene brings. Its pdf_emit is 0 if its line misses the disc.
  LightHit escape(const Vec3f& o, const Vec3f& d) const;

  // Its radiance alone.
  Vec3f background(const Vec3f& d) const;
  // The same without suns.
  Vec3f sky(const Vec3f& d) const { return sky_.radiance(d); }

 private:
  void add_sun(const SunLight& light);
  int distant() const { return static_cast<int>(lamps_.size()); }  // the number of the light at infinity
  float weight(int lamp, const Vec3f& p) const;
  float total_weight(const Vec3f& p) const;
  LightHit lamp_hit(int lamp, float cosine) const;
  bool sample_lamp(int lamp, float chance, const Vec3f& p, Sample2 at, LightSample& out) const;
  void emit_lamp(int lamp, Sample2 place, Sample2 direction, Emission& out) const;
  float distant_density(const Vec3f& d) const;  // not normalised: its integral is distant_strength_
  bool crosses_disc(const Vec3f& o, const Vec3f& d) const;
  Vec3f distant_direction(float left, Sample2 at) const;  // left: in [0, distant_strength_)

  const ObjectSet& objects_;
  std::vector<Lamp> lamps_;                // quads, balls, glowing objects
  std::vector<int> lamp_of_object_;        // -1: it does not glow
  std::vector<kernels::DistantSun> suns_;  // their strength: the radiance, all directions and channels summed
  std::vector<Vec3f> sun_radiance_;
  Sky sky_;
  float sky_strength_ = 0;  // by which it is sampled
  float distant_strength_ = 0;
  float total_power_ = 0;
  Vec3f center_ = Vec3f::Zero();
  float radius_ = 1;
};

}  // namespace firn
