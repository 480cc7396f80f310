// SPDX-License-Identifier: MIT
// Glints. Every particle owns flat facets of ice: places and normals by a hash of its id, in its own frame,
// which turns with it. They are part of the snow: the same facets in every frame and for every sample, and a
// frame of snow that stands still glints as the one before. In: sorted particles with their turns. Out: the
// BRDF of the facets at a point of the surface.
//
// With N facets of area a on a square metre, their normals spread evenly over all directions, its mean is
// that of microfacets (Torrance and Sparrow 1967) of density D = N a / 2 pi. A facet that lies at the point
// counts if its normal is within a cone of the half vector, its roughness and half the light's radius, most
// at the middle:
//   f = F G / (4 cos_i cos_o) * sum over facets  a / (area that it is seen in) * w / (solid angle of the
//   cone)
#pragma once
#include <cstdint>
#include <vector>

#include "src/core/vector.h"
#include "src/particles/snapshot.h"
#include "src/render/render_grid.h"
#include "src/render/setup.h"

namespace firn {

// Of a particle's facets, in its frame as placed: from the particle's centre, within a cube of edge 1 (in
// cube roots of its volume); and a unit normal, of which either side reflects.
Vec3f facet_place(std::uint32_t particle_id, std::uint32_t number);
Vec3f facet_normal(std::uint32_t particle_id, std::uint32_t number);

class Sparkle {
 public:
  // All of them must outlive this. Facets lie one mean spacing deep under the surface.
  Sparkle(const RenderGrid& grid, const Snapshot& snapshot, const std::vector<SnowLook>& looks);

  bool any() const;  // whether any snow has facets

  // 1/sr, at p (render space) of the snow's surface with a unit normal; wo, wi: unit, away from it.
  // light_cone: radians, half the angle that the light fills, where wi is its middle; 0 where wi is a sample
  // of it. footprint: m, radius of what a pixel sees: facets that are smaller are spread over it (and over
  // half a spacing at most), which keeps the mean and spares noise. Nothing is taken from for the snow
  // below: it adds F N a / 4 at most, some 1 % at the defaults.
  float brdf(const Vec3f& p, const Vec3f& normal, const Vec3f& wo, const Vec3f& wi, float light_cone = 0,
             float footprint = 0) const;

 private:
  struct Look {        // of one snow object
    float per_volume;  // facets a m^3
    float area;        // m^2, of one, times its strength
    float size;        // m
    float chord2;      // of the cone of its normals on the unit sphere
  };
  struct Query;
  float add_particle(std::uint32_t sorted, Query& query) const;

  const RenderGrid& grid_;
  const Snapshot& snapshot_;
  float layer_;  // m, half the depth of the facets
  std::vector<Look> looks_;
};

}  // namespace firn
