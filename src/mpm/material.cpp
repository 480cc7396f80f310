// SPDX-License-Identifier: MIT
// In: Young's modulus, Poisson's ratio, density. Out: Lame moduli, wave speeds and the step that they allow.
#include "src/mpm/material.h"

#include <algorithm>
#include <cmath>

namespace firn {

ElasticModuli elastic_moduli(const Material& material) {
  const double nu = material.poisson_ratio;
  const double mu = material.young_modulus / (2 * (1 + nu));
  const double lambda = material.young_modulus * nu / ((1 + nu) * (1 - 2 * nu));
  return {mu, lambda, std::sqrt((lambda + 2 * mu) / material.density), std::sqrt(mu / material.density)};
}

// |dev tau| <= 3 alpha pressure, which is alpha (3 lambda + 2 mu) (-tr L); |dev tau| = 2 mu |dev L|. Sand on
// a slope deforms in a plane, where the middle principal stress is the mean of the others and Mohr-Coulomb
// reads alpha = sqrt(2)/3 sin phi. The fit of Klar et al. 2016, sqrt(2/3) 2 sin phi / (3 - sin phi), is that
// of triaxial compression: with it, sand of 30 degrees stands at 44.
double cone_slope(const Material& material) {
  const double sine = std::sin(material.friction_angle * (M_PI / 180));
  const double alpha = std::sqrt(2.0) / 3 * sine;
  const ElasticModuli moduli = elastic_moduli(material);
  return alpha * (3 * moduli.lambda + 2 * moduli.mu) / (2 * moduli.mu);
}

// Mohr-Coulomb in plane strain again: q = sqrt(3/2) |dev tau| and |dev tau| = sqrt(2) sin phi pressure.
double critical_slope(const Material& material) {
  return std::sqrt(3.0) * std::sin(material.friction_angle * (M_PI / 180));
}

// p0 = kappa (1e-5 + sinh(-xi alpha)), solved for alpha.
double initial_compaction(const Material& material) {
  const ElasticModuli moduli = elastic_moduli(material);
  const double kappa = moduli.lambda + 2 * moduli.mu / 3;
  return -std::asinh(std::max(material.compressive_strength / kappa - 1e-5, 0.0)) / material.hardening;
}

double stable_dt(const Material& material, double dx) {
  return kElasticCourant * dx / elastic_moduli(material).p_wave_speed;
}

}  // namespace firn
