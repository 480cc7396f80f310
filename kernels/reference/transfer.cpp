// SPDX-License-Identifier: MIT
// P2G, grid update and G2P of MLS-MPM (Hu et al. 2018), node by node.
#include <cmath>

#include "kernels/reference/mpm.h"

namespace firn::kernels::reference {

namespace {

struct Stencil {
  int base[3];     // first node of the stencil, as a tile index
  double f[3];     // position in the cell
  double w[3][3];  // weight of node i on an axis
};

Stencil stencil_of(const Particle& p) {
  Stencil s;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(p.x[axis]);
    const double f = p.x[axis] - cell;
    s.base[axis] = static_cast<int>(cell) + 1;
    s.f[axis] = f;
    s.w[axis][0] = 0.5 * (1 - f) * (1 - f);
    s.w[axis][1] = 0.75 - (f - 0.5) * (f - 0.5);
    s.w[axis][2] = 0.5 * f * f;
  }
  return s;
}

// Calls visit(tile node, weight, distance from the particle in cells) for the 27 nodes.
template <class Visit>
void for_each_node(const Stencil& s, Visit&& visit) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) {
        const int node = ((s.base[0] + i) * kTileSide + s.base[1] + j) * kTileSide + s.base[2] + k;
        const double d[3] = {i - 0.5 - s.f[0], j - 0.5 - s.f[1], k - 0.5 - s.f[2]};
        visit(node, s.w[0][i] * s.w[1][j] * s.w[2][k], d);
      }
    }
  }
}

// v: relative to the collider.
void slow_down(const ContactNodes& c, int n, double v[3]) {
  if (c.kind == kSticky) {
    v[0] = v[1] = v[2] = 0;
    return;
  }
  const double normal[3] = {c.normal[0][n], c.normal[1][n], c.normal[2][n]};
  const double v_n = v[0] * normal[0] + v[1] * normal[1] + v[2] * normal[2];
  if (c.kind == kSeparating && v_n >= 0) return;
  double t[3], speed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    t[axis] = v[axis] - v_n * normal[axis];
    speed += t[axis] * t[axis];
  }
  speed = std::sqrt(speed);
  const bool held = speed <= c.static_friction * std::fabs(v_n);
  const double taken = c.friction * std::fabs(v_n);  // Coulomb: mu |v_n|
  for (int axis = 0; axis < 3; ++axis) v[axis] = held ? 0 : t[axis] * (1 - taken / speed);
}

void touch(const ContactNodes& c, int n, double v[3]) {
  double its[3] = {0, 0, 0};
  if (c.moving) {
    const double offset[3] = {double(n / 16), double(n / 4 % 4), double(n % 4)};
    for (int axis = 0; axis < 3; ++axis) {
      const int y = (axis + 1) % 3, z = (axis + 2) % 3;
      its[axis] = c.velocity[axis] + double(c.turn[y]) * offset[z] - double(c.turn[z]) * offset[y];
    }
  }
  for (int axis = 0; axis < 3; ++axis) v[axis] -= its[axis];
  slow_down(c, n, v);
  for (int axis = 0; axis < 3; ++axis) v[axis] += its[axis];
}

}  // namespace

void p2g(const StepParams& step, const MaterialParams* materials, const Particle* particles, int count,
         double* tile) {
  for (int n = 0; n < kTileFloats; ++n) tile[n] = 0;
  for (int q = 0; q < count; ++q) {
    const Particle& p = particles[q];
    double tau[9], affine[9];
    const MaterialParams& material = materials[p.object];
    const double volume = p.m * material.inverse_density;  // as placed
    stress(material, p.F, p.Jp, tau);
    for (int k = 0; k < 9; ++k) {
      affine[k] = p.m * p.C[k] - step.dt * volume * 4 / (double(step.dx) * step.dx) * tau[k];
    }
    for_each_node(stencil_of(p), [&](int node, double w, const double d[3]) {
      for (int r = 0; r < 3; ++r) {
        const double pushed = affine[3 * r] * d[0] + affine[3 * r + 1] * d[1] + affine[3 * r + 2] * d[2];
        tile[4 * node + r] += w * (p.m * p.v[r] + pushed * step.dx);
      }
      tile[4 * node + 3] += w * p.m;
    });
  }
}

void grid_update(const StepParams& step, const ContactNodes* contacts, int contact_count,
                 std::uint64_t counted, double* nodes, double* impulses) {
  for (int n = 0; n < kBlockNodes; ++n) {
    double* node = nodes + 4 * n;
    for (int axis = 0; axis < 3; ++axis) {
      node[axis] = node[3] > step.mass_floor ? node[axis] / node[3] + step.gravity_dt[axis] : 0;
    }
    for (int c = 0; c < contact_count; ++c) {
      if (contacts[c].distance[n] >= kTouchingCells) continue;
      const double before[3] = {node[0], node[1], node[2]};
      touch(contacts[c], n, node);
      if (!(counted >> n & 1)) continue;
      double given[3];
      for (int axis = 0; axis < 3; ++axis) given[axis] = node[3] * (node[axis] - before[axis]);
      const int offset[3] = {n / 16, n / 4 % 4, n % 4};
      double* const sum = impulses + kImpulseParts * contacts[c].collider;
      for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3, last = (axis + 2) % 3;
        sum[axis] += given[axis];
        sum[3 + axis] += offset[next] * given[last] - offset[last] * given[next];
      }
    }
  }
}

void g2p(const StepParams& step, const MaterialParams* materials, Particle* particles, int count,
         const double* tile) {
  for (int q = 0; q < count; ++q) {
    Particle& p = particles[q];
    double v[3] = {0, 0, 0}, c[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    for_each_node(stencil_of(p), [&](int node, double w, const double d[3]) {
      for (int k = 0; k < 9; ++k) c[k] += 4 / double(step.dx) * w * tile[4 * node + k / 3] * d[k % 3];
      for (int axis = 0; axis < 3; ++axis) v[axis] += w * tile[4 * node + axis];
    });
    double f[9];
    for (int k = 0; k < 9; ++k) {
      f[k] = p.F[k];
      for (int j = 0; j < 3; ++j) f[k] += step.dt * c[3 * (k / 3) + j] * p.F[3 * j + k % 3];
    }
    for (int k = 0; k < 9; ++k) {
      p.C[k] = c[k];
      p.F[k] = f[k];
    }
    for (int axis = 0; axis < 3; ++axis) {
      p.v[axis] = v[axis];
      p.x[axis] += step.dt * v[axis] / step.dx;
    }
    if (materials[p.object].plastic) project(materials[p.object], p.F, p.Jp);
  }
}

}  // namespace firn::kernels::reference
