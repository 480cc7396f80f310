// SPDX-License-Identifier: MIT
// In: a shape and a spacing. Out: positions. Jitter breaks the lattice's rows, which would show as layers in
// the picture and as stripes in the first cracks; it is kept to a quarter of the spacing, so that particles
// do not clump.
#include "src/scene/emit.h"

#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/core/rng.h"

namespace firn {
namespace {

constexpr double kJitter = 0.25;  // of the spacing, each way

struct Lattice {
  Vec3 corner;  // m, local
  Vec3 step;    // m; the spacing, stretched so that a whole number of steps fills the bounds
  std::array<long, 3> count;
};

Bounds local_bounds(const Shape& shape) { return world_bounds({shape.form, Pose{}}); }

Lattice lattice_of(const Shape& shape, double spacing) {
  const Bounds bounds = local_bounds(shape);
  Lattice lattice{bounds.min, {}, {}};
  for (int k = 0; k < 3; ++k) {
    lattice.count[k] = std::max(1l, std::lround(bounds.size()[k] / spacing));
    lattice.step[k] = bounds.size()[k] / lattice.count[k];
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
