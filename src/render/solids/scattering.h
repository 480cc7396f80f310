// SPDX-License-Identifier: MIT
// What surfaces do with light: a BSDF to sample, to evaluate and to ask for its density. `wo` and `wi` are
// unit and point away from the surface; either may lie on either side of it.
//   diffuse     Lambert's law, on the side of wo
//   mirror      the albedo, at any angle
//   glossy      GGX facets of alpha = roughness^2 (Walter et al. 2007), sampled by the normals that wo
//               sees (Heitz 2018), Smith's height-correlated shadowing, Schlick's Fresnel from the albedo
//               at normal incidence. Light that meets more than one facet (of white 2 % at roughness 0.3,
//               12 % at 0.5, 29 % at 0.7, 59 % at 1) leaves without direction (facet_energy.h)
//   dielectric  smooth glass or ice: Fresnel's equations, total reflection; it absorbs nothing
//   emission    black: it only glows
//   none        nothing is there: light goes straight on
#pragma once
#include "src/render/sampling/sampler.h"
#include "src/render/setup.h"

namespace firn {

struct SurfacePoint {
  SurfaceKind kind = SurfaceKind::diffuse;
  Vec3f normal;  // unit, outward
  Vec3f albedo;
  float roughness = 0;
  float ior = 1;  // behind the surface, over that before it
};

// Light subpaths carry flux, eye subpaths radiance, which grows by the square of the index where it enters
// glass.
enum class Carries { radiance, importance };

struct Scattered {
  Vec3f direction;         // wi, unit
  Vec3f weight;            // BSDF |cos| / pdf
  float pdf, pdf_reverse;  // of wi given wo, of wo given wi; 1/sr
  // Then the pdfs are chances, over one delta of directions that both share. Refraction changes solid angles,
  // so the reverse one has the factor (n^2 cos of wo) / (n^2 cos of wi).
  bool specular;
};

// Draws wi. `choice` is in [0, 1). False: the light ends here.
bool scatter(const SurfacePoint& surface, const Vec3f& wo, float choice, Sample2 at, Carries carries,
             Scattered& out);

Vec3f evaluate(const SurfacePoint& surface, const Vec3f& wo, const Vec3f& wi);  // BSDF, 1/sr; 0 if specular
float density(const SurfacePoint& surface, const Vec3f& wo,
              const Vec3f& wi);                 // of scatter(), 1/sr; 0 if specular
bool is_specular(const SurfacePoint& surface);  // mirror, dielectric, none

}  // namespace firn
