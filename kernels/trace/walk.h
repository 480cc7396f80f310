// SPDX-License-Identifier: MIT
// Rays' way through the cells: entry into the grid, steps from cell to cell, leaps over empty bricks.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

// Moves rays' origins to where they enter the grid: so far along them as is returned (m), hardly too early
// and never too late. `rest` is what is left of their reach then, negative where they miss. The new origin is
// rounded once, so a far camera costs no precision.
FIRN_INLINE Floats enter_grid(const TraceGrid& grid, const Floats o[3], const Floats d[3], Floats reach,
                              Floats moved[3], Floats& rest) {
  constexpr float kSlack = 4e-7f;  // more than the rounding of the distances
  Mask within = all_lanes();
  Floats size[3];
  for (int a = 0; a < 3; ++a) {
    moved[a] = o[a];
    size[a] = splat(grid.cell * static_cast<float>(grid.cells[a]));
    within = within & less_equal(splat(0), o[a]) & less_equal(o[a], size[a]);
  }
  rest = grid.cells[0] > 0 ? select(less_equal(splat(0), reach), reach, splat(-1)) : splat(-1);
  if (all(within) || grid.cells[0] == 0) return splat(0);
  Floats in = splat(0), out = reach;
  for (int a = 0; a < 3; ++a) {
    const Floats inv = splat(1) / d[a], low = -o[a] * inv, high = (size[a] - o[a]) * inv;
    const Mask flat = less(abs(d[a]), splat(1e-30f));
    const Mask beside = flat & !(less_equal(splat(0), o[a]) & less_equal(o[a], size[a]));
    in = select(flat, in, max(in, min(low, high)));
    out = select(flat, select(beside, splat(-1), out), min(out, max(low, high)));
  }
  in = in * (1 - kSlack);
  const Mask meets = less_equal(in, out * (1 + kSlack));
  const Floats entry = select(meets, in, splat(0));
  for (int a = 0; a < 3; ++a) moved[a] = fma_in_full(entry, d[a], o[a]);
  rest = select(meets, reach - entry, splat(-1));
  return entry;
}

// The same for rays [begin, begin + count), as columns.
FIRN_INLINE void move_to_grid(const TraceGrid& grid, const RayView& rays, std::size_t begin,
                              std::size_t count, float* const (&o)[3], float* const (&d)[3], float* entry,
                              float* rest) {
  for (std::size_t k = 0; k < count; k += kLanes) {
    const int some = count - k < kLanes ? static_cast<int>(count - k) : kLanes;
    Floats from[3], along[3], moved[3], left;
    for (int a = 0; a < 3; ++a) {
      from[a] = load_first(rays.origin[a] + begin + k, some, 0.f);
      along[a] = load_first(rays.direction[a] + begin + k, some, 1.f);
    }
    const Floats reach = load_first(rays.t + begin + k, some, -1.f);
    store_first(entry + k, some, enter_grid(grid, from, along, reach, moved, left));
    store_first(rest + k, some, left);
    for (int a = 0; a < 3; ++a) {
      store_first(o[a] + k, some, moved[a]);
      store_first(d[a] + k, some, along[a]);
    }
  }
}

inline constexpr float kNever = 3e38f;  // m, to planes that a ray does not meet

FIRN_INLINE Floats inverse_of(Floats d) {
  return select(less_equal(abs(d), splat(0)), splat(kNever), splat(1) / d);
}
FIRN_INLINE Ints cell_of(const TraceGrid& grid, int a, Floats p) {
  const Floats last = splat(static_cast<float>(grid.cells[a] - 1));
  return __builtin_convertvector(max(min(p * grid.inv_cell, last), splat(0)), Ints);
}
FIRN_INLINE Mask outside(const TraceGrid& grid, int a, Ints cell) {
  return less(cell, splat_int(0)) | !less(cell, splat_int(grid.cells[a]));
}
// m, along the ray, to the plane before so many cells.
FIRN_INLINE Floats distance_to_plane(const TraceGrid& grid, Floats o, Floats inv, Ints plane) {
  const Floats t = (to_float(plane) * grid.cell - o) * inv;
  return select(less(splat(0.5f * kNever), inv), splat(kNever), t);
}
// The least of three distances, and whose it is.
FIRN_INLINE Floats nearest(const Floats t[3], Mask out[3]) {
  const Floats least = min(t[0], min(t[1], t[2]));
  out[0] = less_equal(t[0], least);
  out[1] = less_equal(t[1], least) & !out[0];
  out[2] = !(out[0] | out[1]);
  return least;
}

// The cells of the bricks nearer to this cell's than `clearance`: [low, high).
FIRN_INLINE void cube_around(Ints cell, Ints clearance, Ints& low, Ints& high) {
  const Ints brick = cell >> 2;
  low = (brick - clearance + 1) * kBrickCells;
  high = (brick + clearance) * kBrickCells;
}

// Each ray goes from its cell out of the cube of cells [low, high) around it: into `cell`, t metres along.
// Returns those that stop there: at the grid's end, or because the cube reaches beyond `reach`. A plane is
// crossed for good, so every walk ends.
FIRN_INLINE Mask leave_cube(const TraceGrid& grid, const Floats o[3], const Floats d[3], const Floats inv[3],
                            const Ints low[3], const Ints high[3], Floats reach, Ints cell[3], Floats& t) {
  Mask forward[3], out[3];
  Floats exit[3];
  for (int a = 0; a < 3; ++a) {
    forward[a] = !less(d[a], splat(0));
    exit[a] = distance_to_plane(grid, o[a], inv[a], select(forward[a], high[a], low[a]));
  }
  t = nearest(exit, out);
  Mask stopped = less_equal(reach, t);
  for (int a = 0; a < 3; ++a) {
    const Ints there = cell_of(grid, a, fma(t, d[a], o[a]));
    const Ints least = select(forward[a], cell[a], low[a]), most = select(forward[a], high[a] - 1, cell[a]);
    const Ints ahead = max(min(max(there, least), most), splat_int(0));
    const Ints aside = min(ahead, splat_int(grid.cells[a] - 1));
    cell[a] = select(out[a], select(forward[a], high[a], low[a] - 1), aside);
    stopped = stopped | (out[a] & outside(grid, a, cell[a]));
  }
  return stopped;
}

// Where a register of rays stands in the grid: each lane has a cell of its own and the distances to the next
// plane of each axis (Amanatides & Woo 1987). Every step crosses a plane for good, so every walk ends.
class Walk {
 public:
  // Lanes in `fresh` stand where their rays begin; o must lie in the grid.
  FIRN_INLINE void place(const TraceGrid& grid, const Floats o[3], const Floats d[3], Mask fresh) {
    for (int a = 0; a < 3; ++a) {
      o_[a] = o[a];
      d_[a] = d[a];
      inv_[a] = inverse_of(d[a]);
      ahead_[a] = select(less(d[a], splat(0)), splat_int(0), splat_int(1));
      cell_[a] = select(fresh, cell_of(grid, a, o[a]), cell_[a]);
      aim(grid, a);
    }
    entered_ = select(fresh, splat(0), entered_);
  }

  Floats origin(int a) const { return o_[a]; }
  Floats direction(int a) const { return d_[a]; }
  Floats entered() const { return entered_; }  // m, along the ray to where it came into its cell
  Floats leaves() const { return min(next_[0], min(next_[1], next_[2])); }

  Ints cell(int a) const { return cell_[a]; }
  FIRN_INLINE Ints brick(const TraceGrid& grid) const {
    return ((cell_[0] >> 2) * grid.bricks[1] + (cell_[1] >> 2)) * grid.bricks[2] + (cell_[2] >> 2);
  }
  FIRN_INLINE Ints cell_in(Ints slot) const {
    return slot * kCellsPerBrick + (((cell_[0] & 3) << 4) + ((cell_[1] & 3) << 2) + (cell_[2] & 3));
  }

  // Lanes in `m` go on to the next cell. Those returned stop: at the grid's end, or because the present cell
  // reaches beyond `reach`.
  FIRN_INLINE Mask step(const TraceGrid& grid, Mask m, Floats reach) {
    Mask out[3];
    const Floats t = nearest(next_, out);
    Mask stopped = less_equal(reach, t);
    entered_ = select(m, t, entered_);
    for (int a = 0; a < 3; ++a) {
      const Mask moved = m & out[a];
      cell_[a] = select(moved, cell_[a] + 2 * ahead_[a] - 1, cell_[a]);
      stopped = stopped | (moved & outside(grid, a, cell_[a]));
      aim(grid, a);
    }
    return stopped & m;
  }

  // Lanes in `m` go out of the cube of empty bricks within `clearance` of theirs. Returns those that stop.
  FIRN_INLINE Mask leap(const TraceGrid& grid, Mask m, Ints clearance, Floats reach) {
    Ints low[3], high[3], cell[3] = {cell_[0], cell_[1], cell_[2]};
    for (int a = 0; a < 3; ++a) cube_around(cell_[a], clearance, low[a], high[a]);
    Floats t;
    const Mask stopped = leave_cube(grid, o_, d_, inv_, low, high, reach, cell, t);
    entered_ = select(m, t, entered_);
    for (int a = 0; a < 3; ++a) {
      cell_[a] = select(m, cell[a], cell_[a]);
      aim(grid, a);
    }
    return stopped & m;
  }

 private:
  FIRN_INLINE Floats plane_distance(const TraceGrid& grid, int a, Ints plane) const {
    return distance_to_plane(grid, o_[a], inv_[a], plane);
  }
  FIRN_INLINE void aim(const TraceGrid& grid, int a) {
    next_[a] = plane_distance(grid, a, cell_[a] + ahead_[a]);
  }

  Floats o_[3], d_[3], inv_[3], next_[3];  // m; next_: to the next plane of each axis
  Floats entered_;
  Ints cell_[3], ahead_[3];  // ahead_: 1 where the ray goes up the axis
};

}  // namespace firn::kernels::FIRN_ISA
