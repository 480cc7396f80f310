// SPDX-License-Identifier: MIT
// In: Young's modulus, Poisson's ratio, density. Out: Lame moduli, wave speeds and the step that they allow.
#include "src/mpm/material.h"

#include <cmath>

namespace firn {

ElasticModuli elastic_moduli(const Material& material) {
  const double nu = material.poisson_ratio;
  const double mu = material.young_modulus / (2 * (1 + nu));
  const double lambda = material.young_modulus * nu / ((1 + nu) * (1 - 2 * nu));
  return {mu, lambda, std::sqrt((lambda + 2 * mu) / material.density), std::sqrt(mu / material.density)};
}

double stable_dt(const Material& material, double dx) {
  return kElasticCourant * dx / elastic_moduli(material).p_wave_speed;
}

double wave_when_packed(const Material& material) {
  if (material.model != kKindOf<kernels::Snow> || !material.plasticity) return 1;
  return std::exp(0.5 * material.hardening * (1 - material.jp_min));
}

}  // namespace firn
