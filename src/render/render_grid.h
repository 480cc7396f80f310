// SPDX-License-Identifier: MIT
// A uniform grid over the balls of one snapshot, rebuilt every frame by a counting sort: Snapshot -> sorted
// balls -> cells -> the view that the trace kernels read. Two floors: a dense table of bricks (4x4x4 cells)
// over the bounds, cells only for bricks that a ball touches; so empty air costs 5 bytes a brick. Balls too
// large or too far for the cells become strays, which every ray tests. Everything is a pure function of the
// snapshot: counts are integers, and each cell's balls are in snapshot order.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/trace/table.h"
#include "src/particles/snapshot.h"
#include "src/render/grid_layout.h"

namespace firn {

inline constexpr std::size_t kNoCell = SIZE_MAX;

// A cell's place in cell_start, bundle_start and SnowSurface's nodes; kNoCell outside the occupied bricks.
inline std::size_t cell_index(const kernels::TraceGrid& grid, int x, int y, int z) {
  if (x < 0 || y < 0 || z < 0 || x >= grid.cells[0] || y >= grid.cells[1] || z >= grid.cells[2])
    return kNoCell;
  const std::uint32_t slot =
      grid.slot[(static_cast<std::size_t>(x >> 2) * grid.bricks[1] + (y >> 2)) * grid.bricks[2] + (z >> 2)];
  if (slot == kernels::kNoBrick) return kNoCell;
  return static_cast<std::size_t>(slot) * kernels::kCellsPerBrick + ((x & 3) << 4) + ((y & 3) << 2) + (z & 3);
}

class RenderGrid {
 public:
  // An unstable Error if a position or volume is not finite.
  void build(const Snapshot& snapshot, const std::vector<SnowLook>& looks);

  const kernels::TraceGrid& view() const { return view_; }
  std::size_t size() const { return order_.size(); }
  Vec3 origin() const { return layout_.origin; }      // m, world place of the render space's 0
  double spacing() const { return layout_.spacing; }  // m, mean particle spacing
  const std::vector<std::uint32_t>& brick_of_slot() const { return brick_of_slot_; }  // occupied bricks
  bool is_core(std::size_t slot) const { return core_[slot] != 0; }
  std::size_t bytes() const;

  // Of a sorted index.
  std::uint32_t snapshot_index(std::uint32_t sorted) const { return order_[sorted]; }
  Vec3f center(std::uint32_t sorted) const { return {x_[0][sorted], x_[1][sorted], x_[2][sorted]}; }
  float radius(std::uint32_t sorted) const { return radius_[sorted]; }

 private:
  void open_view();
  void place_bricks(const Snapshot& snapshot);
  void measure_clearance();
  void sort_balls(const Snapshot& snapshot);
  void find_core();
  void fit_radii();
  float count_neighbours(const int cell[3], std::uint64_t s) const;
  void fill_bundles();
  void fill_strays();
  void publish();

  GridLayout layout_;
  kernels::TraceGrid view_;
  std::vector<std::uint32_t> slot_;
  std::vector<std::uint8_t> clearance_, core_;
  std::vector<std::uint32_t> brick_of_slot_;
  std::vector<std::uint64_t> cell_start_, bundle_start_;
  std::vector<std::uint32_t> order_;  // sorted -> snapshot index; strays last
  std::vector<float> x_[3], radius_;  // m, sorted
  std::vector<kernels::BallBundle> bundles_, strays_;
};

}  // namespace firn
