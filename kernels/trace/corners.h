// SPDX-License-Identifier: MIT
// Fields of the snow at points: a register of them, each in a cell of its own, the eight corners of its cell
// by gathers.
#pragma once
#include "kernels/simd/lanes.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

// Places in a field of kBrickCorners a brick, of the first corner of cells in bricks (their places in it).
FIRN_INLINE Ints first_corner(Ints brick, Ints x, Ints y, Ints z) {
  return brick * kBrickCorners + (x & 3) * (kCornerSide * kCornerSide) + (y & 3) * kCornerSide + (z & 3);
}

struct Corners {
  Ints first;
  Floats part[3];  // of the way through the cell

  // A trilinear field, or the one at `field` of kFields that lie side by side; 0 in other lanes.
  template <int kFields = 1>
  FIRN_INLINE Floats of(const float* field, Mask lanes) const {
    Floats along_z[4];
    for (int k = 0; k < 4; ++k) {
      const Ints at = first + ((k >> 1) * kCornerSide * kCornerSide + (k & 1) * kCornerSide);
      along_z[k] = mix(gather(field, at * kFields, lanes), gather(field, (at + 1) * kFields, lanes), part[2]);
    }
    return mix(mix(along_z[0], along_z[1], part[1]), mix(along_z[2], along_z[3], part[1]), part[0]);
  }

 private:
  FIRN_INLINE static Floats mix(Floats low, Floats high, Floats by) { return fma(by, high - low, low); }
};

// Points in their cells.
struct CellPoints {
  Ints cell[3], slot;
  Floats part[3];
  Mask inside;  // lanes whose bricks are occupied

  // p: m.
  FIRN_INLINE CellPoints(const TraceGrid& grid, const Floats p[3], Mask lanes) : inside(lanes) {
    for (int a = 0; a < 3; ++a) {
      const Floats at = p[a] * grid.inv_cell;
      inside = inside & less_equal(splat(0), at) & less(at, splat(static_cast<float>(grid.cells[a])));
      const Floats held = select(inside, at, splat(0));
      cell[a] = __builtin_convertvector(held, Ints);
      part[a] = held - to_float(cell[a]);
    }
    const Ints brick = ((cell[0] >> 2) * grid.bricks[1] + (cell[1] >> 2)) * grid.bricks[2] + (cell[2] >> 2);
    slot = gather(grid.slot, brick, inside);
    inside = inside & !less(slot, splat_int(0));
  }
  // In a field that has bricks in these places.
  FIRN_INLINE Corners corners(Ints place) const {
    return {first_corner(place, cell[0], cell[1], cell[2]), {part[0], part[1], part[2]}};
  }
};

}  // namespace firn::kernels::FIRN_ISA
