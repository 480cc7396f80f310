// SPDX-License-Identifier: MIT
// Glints: the BRDF of the facets of ice at the snow's surface. Each particle owns facets (facets.h) by a hash
// of its id, in its own frame, which moves and turns with it. So they are part of the snow: a frame of snow
// that stands still glints as the one before, at any number of samples. A facet that the surface shows at a
// point shines as far as the half vector lies in the cone of its normals:
//   f = F(wo . h) D G / (4 cos_i cos_o),   D = sum over facets (share of area) (share of cone) / (solid
//   angle)
// Normals are spread evenly over all directions, so the mean of D is coverage / 2 pi. Even normals are GGX
// with alpha = 1 (Walter et al. 2007), whose masking and shadowing are G = 2 cos_i cos_o / (cos_i + cos_o)
// (Smith, height-correlated: Heitz 2014).
#pragma once
#include <cstdint>
#include <vector>

#include "src/render/snow/facets.h"
#include "src/render/snow/render_grid.h"

namespace firn {

class Sparkle {
 public:
  // Grid and snapshot must outlive this.
  Sparkle(const RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks);

  bool any() const;  // whether any snow has facets

  // 1/sr, at p (render space) of the snow's surface. sorted: the particle whose centre is nearest, or whose
  // ball it is. normal: outward, wo, wi: away from the surface; unit vectors. light_cone: radians, half the
  // angle that the light fills, where wi is its middle; 0 where wi is a sample of it. Light from a cone much
  // wider than the facets' own meets so many of them that their mean is returned. footprint: m, radius of
  // what a pixel sees: facets smaller than it are spread over it, which keeps the mean and spares noise.
  float brdf(std::uint32_t sorted, const Vec3f& p, const Vec3f& normal, const Vec3f& wo, const Vec3f& wi,
             float light_cone = 0, float footprint = 0) const;

  // Of an object's snow, for ShadeKernels::may_glint: where that says no, brdf() is 0.
  kernels::FacetCells cells(std::size_t object) const;

  // What brdf() is in the mean over many particles.
  float mean_brdf(std::uint32_t sorted, const Vec3f& normal, const Vec3f& wo, const Vec3f& wi) const;

 private:
  struct Look {
    FacetField facets;
    float chord;  // of the cone of a facet's normals, on the unit sphere
    float strength;
  };
  struct Shine;  // F G / (4 cos_i cos_o) and the half vector
  const Look& look_of(std::uint32_t particle) const;
  float glints(const Look& look, std::uint32_t sorted, const Vec3f& p, const Vec3f& normal, const Vec3f& half,
               float light_chord, float footprint) const;

  const RenderGrid& grid_;
  const Snapshot& snapshot_;
  std::vector<Look> looks_;
};

}  // namespace firn
