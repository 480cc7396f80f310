// SPDX-License-Identifier: MIT
// In: a shape and a spacing. Out: positions. Jitter breaks the lattice's rows, which would show as layers in
// the picture and as stripes in the first cracks; it is kept to a quarter of the spacing, so that particles
// do not clump.
#include "src/scene/emit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "src/core/parallel.h"
#include "src/core/rng.h"

namespace firn {
namespace {

constexpr double kJitter = 0.25;  // of the spacing, each way

struct Lattice {
  Vec3 corner;  // m, local
  Vec3 step;    // m
  std::array<long, 3> count;
};

// The axes along which a form has flat ends. There the spacing is stretched until a whole number of steps
// fits, so that the ends are filled evenly; elsewhere it stays as asked for.
std::array<bool, 3> fitted_axes(const Shape& shape) {
  if (std::holds_alternative<Box>(shape.form)) return {true, true, true};
  if (std::holds_alternative<Cylinder>(shape.form)) return {false, true, false};
  if (std::holds_alternative<HeightField>(shape.form)) return {true, false, true};
  return {false, false, false};
}

Lattice lattice_of(const Shape& shape, double spacing) {
  const Bounds bounds = world_bounds({shape.form, Pose{}});
  const std::array<bool, 3> fitted = fitted_axes(shape);
  Lattice lattice{};
  for (int k = 0; k < 3; ++k) {
    const double steps = bounds.size()[k] / spacing;
    lattice.count[k] = std::max(1l, fitted[k] ? std::lround(steps) : std::lround(std::ceil(steps)));
    lattice.step[k] = fitted[k] ? bounds.size()[k] / lattice.count[k] : spacing;
    lattice.corner[k] = bounds.center()[k] - 0.5 * lattice.count[k] * lattice.step[k];
  }
  return lattice;
}

Vec3 jittered(const Lattice& lattice, long i, long j, long k, std::uint64_t key) {
  const auto axis = [&](long index, int a) {
    const double jitter = kJitter * (2 * uniform_double(hash_keys(key, i, j, k, a)) - 1);
    return lattice.corner[a] + (index + 0.5 + jitter) * lattice.step[a];
  };
  return {axis(i, 0), axis(j, 1), axis(k, 2)};
}

}  // namespace

double particle_spacing(double dx, int particles_per_cell) { return dx / std::cbrt(particles_per_cell); }

std::vector<Vec3> fill_shape(const Shape& shape, double spacing, std::uint64_t key) {
  const Lattice lattice = lattice_of(shape, spacing);
  std::vector<std::vector<Vec3>> layers(lattice.count[1]);
  parallel_for(layers.size(), 1, [&](std::size_t j) {
    for (long k = 0; k < lattice.count[2]; ++k) {
      for (long i = 0; i < lattice.count[0]; ++i) {
        const Vec3 world = shape.pose.to_world(jittered(lattice, i, static_cast<long>(j), k, key));
        if (signed_distance(shape, world) < 0) layers[j].push_back(world);
      }
    }
  });
  std::vector<Vec3> positions;
  for (const auto& layer : layers) positions.insert(positions.end(), layer.begin(), layer.end());
  return positions;
}

}  // namespace firn
