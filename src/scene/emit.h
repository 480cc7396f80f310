// SPDX-License-Identifier: MIT
// Fills shapes with particles: a jittered lattice in each shape's own frame, so that no two particles are
// nearer than half the spacing and a sheet is filled to its edges. Deterministic in the seed, for any number
// of threads.
#pragma once
#include <cstdint>
#include <vector>

#include "src/core/vector.h"
#include "src/geometry/shape.h"

namespace firn {

// m; the distance between lattice points that gives `particles_per_cell` in a cube of dx.
double particle_spacing(double dx, int particles_per_cell);

// World positions (m) of the particles inside `shape`, about one per spacing^3. `key` makes the jitter of
// this shape.
std::vector<Vec3> fill_shape(const Shape& shape, double spacing, std::uint64_t key);

}  // namespace firn
