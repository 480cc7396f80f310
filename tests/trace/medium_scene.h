// SPDX-License-Identifier: MIT
// Snow that scatters, for the tests of the medium's kernels.
#pragma once
#include <limits>
#include <utility>
#include <vector>

#include "src/core/rng.h"
#include "src/render/snow/snow_field.h"
#include "tests/trace/ray_cases.h"

namespace firn::test {

// `optical` is the extinction of a cell of evenly packed snow times its size.
inline SnowLook look_of(double optical, double density = 400) {
  SnowLook look;
  look.density = density;
  look.extinction = optical / (1.6 * density);
  return look;
}

struct Scene {
  Scene(Snapshot given, const std::vector<SnowLook>& looks, SnowShape shape = SnowShape::smooth,
        const SnowOptics& optics = {}, const kernels::TraceKernels& table = best_trace())
      : kernels(table), snapshot(std::move(given)), grid(table), field(table) {
    grid.build(snapshot, looks, true);
    field.build(grid, snapshot, looks, shape);
    medium = field.medium(optics);
  }
  void collide(RayStream& rays, const std::vector<std::uint64_t>& keys) const {
    kernels.collide(field.view(), medium, rays.view(), keys.data(), nullptr, 0, rays.size());
  }
  double depth(const RayStream& rays, std::size_t i, double to) const {
    const Vec3 o = rays.origin(i).cast<double>(), d = rays.direction(i).cast<double>().normalized();
    const std::size_t in_cells = grid.view().cell_start[grid.brick_of_slot().size() * 64];
    return kernels::reference::optical_depth(field.view(), medium, in_cells, o.data(), d.data(), 0, to);
  }

  // Of cells of occupied bricks, by their places as in cell_index.
  std::uint32_t class_of(std::size_t cell) const { return medium.cell[cell] & kernels::kClass; }
  bool has_depth() const {
    std::uint32_t any = 0;
    for (std::size_t cell = 0; cell < grid.brick_of_slot().size() * kernels::kCellsPerBrick; ++cell)
      any |= class_of(cell);
    return any != 0;
  }

  const kernels::TraceKernels& kernels;
  Snapshot snapshot;
  RenderGrid grid;
  SnowField field;
  kernels::MediumField medium;
};

inline std::vector<std::uint64_t> keys_of(std::size_t count, std::uint64_t seed) {
  std::vector<std::uint64_t> keys(count);
  for (std::size_t i = 0; i < count; ++i) keys[i] = hash_keys(seed, i);
  return keys;
}
}  // namespace firn::test
