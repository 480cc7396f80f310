// SPDX-License-Identifier: MIT
// The MPM kernels once more, in plain scalar double, one particle at a time, as the equations read: the
// oracle of the kernel tests. Never called by a simulation. Matrices are row-major; see kernels/mpm/views.h
// for lattice and tiles.
#pragma once
#include "kernels/mpm/views.h"
#include "kernels/reference/matrix.h"

namespace firn::kernels::reference {

struct Particle {
  double x[3];  // cells from the block's corner
  double v[3];
  double C[9];
  double F[9];
  double Jp, m;
  int object;
};

// Kirchhoff stress and J per m^3 of placed volume.
void stress(const MaterialParams& material, const double f[9], double jp, double tau[9]);
double energy(const MaterialParams& material, const double f[9], double jp);

// m^2/s^2, of the fastest elastic wave.
double wave_speed2(const MaterialParams& material, const double f[9], double jp);

// F and Jp through the yield surface; true when F changed.
bool project(const MaterialParams& material, double f[9], double& jp);

// tile: 8x8x8 nodes of momentum and mass, zeroed first.
void p2g(const StepParams& step, const MaterialParams* materials, const Particle* particles, int count,
         double* tile);
// nodes: 64 of momentum and mass -> velocity and mass.
void grid_update(const StepParams& step, const ContactNodes* contacts, int contact_count,
                 std::uint64_t counted, double* nodes, double* impulses);
void g2p(const StepParams& step, const MaterialParams* materials, Particle* particles, int count,
         const double* tile);

}  // namespace firn::kernels::reference
