// SPDX-License-Identifier: MIT
// Material parameters as a person states them: what all materials have, and of each what it alone has
// (kernels/materials, with the sources). Derived constants (Lame moduli, wave speeds) come from one function.
#pragma once
#include "kernels/materials/list.h"

namespace firn {

using kernels::kKindOf;

template <class... Materials>
struct StatedOf : Materials::Stated... {};

struct Material : kernels::OfAllMaterials<StatedOf> {
  kernels::MaterialKind model = kKindOf<kernels::Snow>;
  bool plasticity = true;        // off: purely elastic
  double density = 400;          // kg/m^3, as placed
  double young_modulus = 1.4e5;  // Pa
  double poisson_ratio = 0.2;    // -
  double hardening = 10;         // xi, of snow (mu and lambda scale by exp(xi (1 - Jp))) and cam_clay
  double jp_min = 0.6;           // bounds of the plastic volume ratio Jp
  double jp_max = 20;
  double friction_angle = 30;  // degrees, of the cone that is Mohr-Coulomb's in plane strain
};

struct ElasticModuli {
  double mu;            // Pa
  double lambda;        // Pa
  double p_wave_speed;  // m/s, sqrt((lambda + 2 mu) / density), unhardened
  double s_wave_speed;  // m/s
};
ElasticModuli elastic_moduli(const Material& material);

// Of the time in which an elastic wave crosses one cell, the part that an explicit step may take.
constexpr double kElasticCourant = 0.6;
// s; the longest stable step of this snow as placed (unhardened, at rest) on a grid of spacing dx (m). Packed
// snow needs shorter ones: the adaptive step looks at the stiffest particle.
double stable_dt(const Material& material, double dx);
// How many times as fast as in fresh snow an elastic wave can be when it is packed as far as it can be.
double wave_when_packed(const Material& material);

}  // namespace firn
