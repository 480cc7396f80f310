// SPDX-License-Identifier: MIT
// Light sources. Every path of light is found by exactly one strategy, so nothing is counted twice:
// quads, balls and the sun by sampling them from a surface point (and by seeing them directly or in a
// mirror); sky and constant light by rays that leave the scene.
#pragma once
#include <vector>

#include "src/render/sampler.h"
#include "src/render/setup.h"

namespace firn {

struct LightSample {
  Vec3f direction;        // unit, towards the light
  float distance = 0;     // m; infinite for the sun
  Vec3f radiance_by_pdf;  // radiance / density per solid angle: times cosine and BRDF it is the estimate
};

class LightSet {
 public:
  explicit LightSet(std::vector<Light> lights);

  // Render space is world space minus `origin`.
  void place(const Vec3& origin);

  // One light, chosen by what it could send to `p` unhindered, and a point of it. False if none can be seen.
  bool sample(const Vec3f& p, float choice, Sample2 at, LightSample& out) const;

  // The nearest quad or ball that a ray meets before `t`: shortens t and returns its radiance.
  bool hit(const Vec3f& o, const Vec3f& d, float& t, Vec3f& radiance) const;

  // What a ray that leaves the scene brings back; the sun's disc only if `see_sun`.
  Vec3f escape(const Vec3f& d, bool see_sun) const;

 private:
  struct Quad {
    Vec3 corner;  // m, world
    Vec3f p, u, v, normal, radiance;
    float area;
  };
  struct Ball {
    Vec3 center;  // m, world
    Vec3f p, radiance;
    float radius;
  };
  struct Sun {
    Vec3f direction, irradiance, radiance;
    float spread;  // 1 - cos(angular radius)
  };

  void add(const QuadLight& light);
  void add(const SphereLight& light);
  void add(const SunLight& light);
  void add(const SkyLight& light) { skies_.push_back(light); }
  void add(const ConstantLight& light) { constant_ += light.radiance; }
  float weight(std::size_t light, const Vec3f& p) const;
  bool sample_quad(const Quad& quad, const Vec3f& p, Sample2 at, LightSample& out) const;
  bool sample_ball(const Ball& ball, const Vec3f& p, Sample2 at, LightSample& out) const;

  std::vector<Quad> quads_;
  std::vector<Ball> balls_;
  std::vector<Sun> suns_;
  std::vector<SkyLight> skies_;
  Vec3f constant_ = Vec3f::Zero();
};

}  // namespace firn
