// SPDX-License-Identifier: MIT
// Material parameters as a person states them. Derived constants (Lame moduli, wave speeds) come from one
// function. Sources: neo-Hookean with clamp: the source paper (docs/physics.md), snow: Stomakhin et al. 2013,
// sections 5 and 6, drucker_prager: Klar et al. 2016,
// cam_clay: Gaume et al. 2018.
#pragma once

namespace firn {

enum class MaterialModel { neo_hookean, snow, drucker_prager, cam_clay };

struct Material {
  MaterialModel model = MaterialModel::snow;
  bool plasticity = true;        // off: purely elastic
  double density = 400;          // kg/m^3, as placed
  double young_modulus = 1.4e5;  // Pa
  double poisson_ratio = 0.2;    // -
  // snow: singular values of F_E are kept in [1 - critical_compression, 1 + critical_stretch]
  double critical_compression = 2.5e-2;  // theta_c
  double critical_stretch = 7.5e-3;      // theta_s
  double hardening = 10;                 // xi; mu and lambda scale by exp(xi (1 - Jp))
  double jp_min = 0.6;                   // bounds of the plastic volume ratio Jp
  double jp_max = 20;
  // neo_hookean: singular values of F are kept in [sigma_min, sigma_max]
  double sigma_min = 0.975;
  double sigma_max = 1.0075;
  // drucker_prager, cam_clay
  double friction_angle = 30;  // degrees, of the cone that is Mohr-Coulomb's in plane strain
  double cohesion = 0;         // ln of the stretch, equal in all directions, that parts grains that touch
  // cam_clay; `hardening` is its xi
  double compressive_strength = 1e3;  // Pa, p0 at the start
  double cohesion_ratio = 0.3;        // beta: tensile strength / compressive strength
  // -ln of the volume ratio by which a layer closes once it has lost its cohesion; 0: it keeps cohesion
  double collapse = 0;
};

struct ElasticModuli {
  double mu;            // Pa
  double lambda;        // Pa
  double p_wave_speed;  // m/s, sqrt((lambda + 2 mu) / density), unhardened
  double s_wave_speed;  // m/s
};
ElasticModuli elastic_moduli(const Material& material);

// Largest |dev L| / -tr L of Drucker-Prager grains, L the logarithmic strain.
double cone_slope(const Material& material);

// Cam-Clay: M, largest von Mises stress / pressure at constant volume, and alpha at the start.
double critical_slope(const Material& material);
double initial_compaction(const Material& material);

// Of the time in which an elastic wave crosses one cell, the part that an explicit step may take.
constexpr double kElasticCourant = 0.6;
// s; the longest stable step of this snow as placed (unhardened, at rest) on a grid of spacing dx (m). Packed
// snow needs shorter ones: the adaptive step looks at the stiffest particle.
double stable_dt(const Material& material, double dx);

}  // namespace firn
