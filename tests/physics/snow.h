// SPDX-License-Identifier: MIT
// Snow for tests: bodies on a lattice of `per_axis`^3 particles a cell.
#pragma once
#include <Eigen/Geometry>

#include <cmath>
#include <functional>
#include <initializer_list>
#include <string>

#include "src/core/isa.h"
#include "src/mpm/solver.h"
#include "tests/catch.h"
#include "tests/threads.h"

namespace firn::test {

inline const kernels::KernelTable& best_kernels() { return *supported_kernels().back(); }

// Calls f(table) with the kernels of x86-64-v3 and v4, as far as this CPU has them, and with each of these
// numbers of threads: all of them promise the same bits.
template <class F>
void with_kernels_and_threads(std::initializer_list<int> threads, F&& f) {
  const auto tables = supported_kernels();
  for (std::size_t t = 1; t < tables.size(); ++t) {
    for (const int count : threads) {
      INFO(tables[t]->isa << ", " << count << " threads");
      with_threads(count, [&] { f(*tables[t]); });
    }
  }
}

// Elastic snow: plasticity off.
inline Material elastic(kernels::MaterialKind model = kKindOf<kernels::Snow>) {
  Material m;
  m.model = model;
  m.plasticity = false;
  return m;
}

// The lattice points of [low, high) for which `inside` holds, spacing dx / per_axis, half a spacing off the
// corner.
inline PlacedSnow fill(const Vec3& low, const Vec3& high, double dx, int per_axis, const Material& material,
                       const std::function<bool(const Vec3&)>& inside = {}) {
  PlacedSnow snow;
  snow.name = "body";
  snow.material = material;
  const double h = dx / per_axis;
  snow.particle_volume = h * h * h;
  const auto count = [&](int axis) { return static_cast<int>(std::lround((high[axis] - low[axis]) / h)); };
  for (int i = 0; i < count(0); ++i) {
    for (int j = 0; j < count(1); ++j) {
      for (int k = 0; k < count(2); ++k) {
        const Vec3 x = low + h * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (inside && !inside(x)) continue;
        snow.position.push_back(x);
        snow.velocity.push_back(Vec3::Zero());
      }
    }
  }
  return snow;
}

inline PlacedSnow ball(const Vec3& center, double radius, double dx, const Material& material,
                       const Vec3& velocity, int per_axis = 2) {
  PlacedSnow snow = fill(center - Vec3::Constant(radius), center + Vec3::Constant(radius), dx, per_axis,
                         material, [&](const Vec3& x) { return (x - center).norm() < radius; });
  for (Vec3& v : snow.velocity) v = velocity;
  return snow;
}

inline Collider plane(const Vec3& point, const Vec3& normal, Contact contact, double friction) {
  Collider c;
  c.name = "plane";
  c.shape.form = HalfSpace{};
  const Vec3 up = normal.normalized();
  const Vec3 side = up.unitOrthogonal();
  c.shape.pose.rotation.col(0) = side;
  c.shape.pose.rotation.col(1) = up;
  c.shape.pose.rotation.col(2) = side.cross(up);
  c.shape.pose.translation = point;
  c.contact = contact;
  c.friction = friction;
  return c;
}

}  // namespace firn::test
