// SPDX-License-Identifier: MIT
// A uniform grid over the balls of one snapshot, rebuilt every frame by a counting sort: Snapshot -> brick
// and cell of each ball -> sorted balls -> the view that the trace kernels read. Two floors: a dense table of
// bricks (4x4x4 cells) over the bounds, cells only for bricks that a ball touches; so empty air costs 4 bytes
// a brick. Balls too large or too far for the cells become strays, which every ray tests. All that is built
// here is a pure function of the snapshot: each cell's balls are in snapshot order. The order that the
// simulation keeps (blocks of neighbours) makes the sort read and write near places.
#pragma once
#include <cstdint>
#include <vector>

#include "firn/snapshot.h"
#include "kernels/trace/table.h"
#include "src/core/aligned.h"
#include "src/render/snow/grid_layout.h"

namespace firn {

inline constexpr std::size_t kNoCell = SIZE_MAX;

// Fills the bricks of a table that are empty (negative) with how far they are from the others, as
// TraceGrid::slot has it.
void measure_clearance(const int bricks[3], std::vector<std::int32_t>& slot);

// A brick's place in the table, and back to where it lies.
inline std::size_t brick_index(const kernels::TraceGrid& grid, int x, int y, int z) {
  return (static_cast<std::size_t>(x) * grid.bricks[1] + y) * grid.bricks[2] + z;
}
inline void brick_place(const kernels::TraceGrid& grid, std::size_t brick, int place[3]) {
  place[0] = static_cast<int>(brick / grid.bricks[2] / grid.bricks[1]);
  place[1] = static_cast<int>(brick / grid.bricks[2] % grid.bricks[1]);
  place[2] = static_cast<int>(brick % grid.bricks[2]);
}

// A cell's place in cell_start and list; kNoCell outside the occupied bricks.
inline std::size_t cell_index(const kernels::TraceGrid& grid, int x, int y, int z) {
  if (x < 0 || y < 0 || z < 0 || x >= grid.cells[0] || y >= grid.cells[1] || z >= grid.cells[2])
    return kNoCell;
  const std::int32_t slot = grid.slot[brick_index(grid, x >> 2, y >> 2, z >> 2)];
  if (slot < 0) return kNoCell;
  return static_cast<std::size_t>(slot) * kernels::kCellsPerBrick + ((x & 3) << 4) + ((y & 3) << 2) + (z & 3);
}

class RenderGrid {
 public:
  explicit RenderGrid(const kernels::TraceKernels& kernels) : kernels_(kernels) {}

  // An unstable Error if a position or volume is not finite.
  // fields: with cells for all that SnowField reaches.
  void build(const Snapshot& snapshot, const std::vector<SnowLook>& looks, bool fields = false);

  // Gives each ball (by sorted index) another radius, no larger than it was; at -1 it is none. For after
  // build().
  void set_radii(const std::vector<float>& radii);
  // Empties the lists of the cells that no ball reaches; set_radii() does too. For after build().
  void empty_unreached_lists();

  const kernels::TraceGrid& view() const { return view_; }
  std::size_t size() const { return order_.size(); }
  Vec3 origin() const { return layout_.origin; }      // m, world place of the render space's 0
  double spacing() const { return layout_.spacing; }  // m, mean particle spacing
  Vec3f middle() const;  // m, render space: the mean place of particles, of about a thousand of them
  const std::vector<std::uint32_t>& brick_of_slot() const { return brick_of_slot_; }  // occupied bricks
  // A bit for each cell of the brick that holds a particle.
  std::uint64_t occupied(std::size_t slot) const { return occupied_[slot]; }
  // All particles are of one volume and one object.
  bool alike() const { return layout_.sizes.alike(); }
  std::size_t bytes() const;

  // Of a sorted index.
  std::uint32_t snapshot_index(std::uint32_t sorted) const { return order_[sorted]; }
  Vec3f center(std::uint32_t sorted) const { return {x_[0][sorted], x_[1][sorted], x_[2][sorted]}; }
  float radius(std::uint32_t sorted) const { return radius_.empty() ? view_.max_radius : radius_[sorted]; }

 private:
  void open_view();
  void find_cells(const Snapshot& snapshot);
  void number_bricks();
  void sort_by_brick(std::size_t count);
  void sort_bricks(const Snapshot& snapshot);
  void open_touched_bricks(float reach);
  void open_room(std::size_t count);
  void open_lists(bool later);
  std::uint64_t cells_near_balls(std::size_t slot) const;
  void list_strays();
  std::size_t bricks_in_table() const {
    return static_cast<std::size_t>(view_.bricks[0]) * view_.bricks[1] * view_.bricks[2];
  }

  const kernels::TraceKernels& kernels_;
  GridLayout layout_;
  kernels::TraceGrid view_;
  std::vector<std::int32_t> slot_;
  std::vector<std::uint32_t> brick_of_slot_;
  std::vector<std::uint32_t> cell_start_, list_;
  std::vector<std::uint32_t> order_;  // sorted -> snapshot index; strays last
  std::vector<float> x_[3], radius_;  // m, sorted; no radii if all are alike
  AlignedArray<float> lists_;
  std::vector<kernels::BallBundle> strays_;
  std::vector<std::uint64_t> units_used_;  // one count, at an address that moving does not change
  // Of the sort alone.
  std::uint32_t* code_ = nullptr;           // per particle of the snapshot
  std::uint8_t* cell_by_brick_ = nullptr;   // per particle sorted by brick
  std::vector<std::uint32_t> brick_start_;  // per slot, one more for the strays and one at the end
  std::vector<std::uint64_t> occupied_;     // per slot: a bit for each cell with a ball's centre
};

}  // namespace firn
