// SPDX-License-Identifier: MIT
// The list of balls that overlap one cell, made by the first ray that comes to it from the balls sorted by
// centre. Whoever changes the cell's word from kUnlisted to kNoList makes the list and then publishes it;
// rays of other threads that come meanwhile read the cells around by centre, as all do when there is no room
// left. The nearest hit is the same either way.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

FIRN_INLINE std::size_t brick_at(const TraceGrid& grid, int x, int y, int z) {
  return (static_cast<std::size_t>(x) * grid.bricks[1] + y) * grid.bricks[2] + z;
}
// The cell's place in cell_start and list.
FIRN_INLINE std::size_t cell_at(std::int32_t slot, int x, int y, int z) {
  return static_cast<std::size_t>(slot) * kCellsPerBrick + ((x & 3) << 4) + ((y & 3) << 2) + (z & 3);
}

// Calls run(begin, end) for the sorted balls of cells low to high. Cells that follow one another along z in a
// brick are one run.
template <class Run>
FIRN_INLINE void for_each_run(const TraceGrid& grid, const int low[3], const int high[3], Run&& run) {
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2];) {
        const int last = (z | 3) < high[2] ? (z | 3) : high[2];
        const std::int32_t slot = grid.slot[brick_at(grid, x >> 2, y >> 2, z >> 2)];
        if (slot >= 0) {
          const std::size_t place = cell_at(slot, x, y, z);
          const std::uint32_t begin = grid.cell_start[place], end = grid.cell_start[place + (last - z) + 1];
          if (begin < end) run(begin, end);
        }
        z = last + 1;
      }
    }
  }
}

// The same for the cells within `reach` cells of this one.
template <class Run>
FIRN_INLINE void for_each_run_around(const TraceGrid& grid, const int cell[3], int reach, Run&& run) {
  int low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    low[a] = cell[a] > reach ? cell[a] - reach : 0;
    high[a] = cell[a] + reach < grid.cells[a] ? cell[a] + reach : grid.cells[a] - 1;
  }
  for_each_run(grid, low, high, run);
}

// Calls run(begin, end) for the sorted balls of cells low to high, and of cells beside them in the same
// bricks: so the cells of several rows are one run, and registers are full.
template <class Run>
FIRN_INLINE void for_each_long_run(const TraceGrid& grid, const int low[3], const int high[3], Run&& run) {
  for (int bx = low[0] >> 2; bx <= high[0] >> 2; ++bx) {
    for (int by = low[1] >> 2; by <= high[1] >> 2; ++by) {
      for (int bz = low[2] >> 2; bz <= high[2] >> 2; ++bz) {
        const std::int32_t slot = grid.slot[brick_at(grid, bx, by, bz)];
        if (slot < 0) continue;
        const std::uint32_t* const start = grid.cell_start + static_cast<std::size_t>(slot) * kCellsPerBrick;
        if (start[0] == start[kCellsPerBrick]) continue;
        const int x0 = low[0] > 4 * bx ? low[0] & 3 : 0, x1 = high[0] < 4 * bx + 3 ? high[0] & 3 : 3;
        int y0 = low[1] > 4 * by ? low[1] & 3 : 0, y1 = high[1] < 4 * by + 3 ? high[1] & 3 : 3;
        int more = 0;  // of x, in one run with the first
        if (y1 - y0 >= 2) y0 = 0, y1 = 3, more = x1 - x0;
        for (int x = x0; x + more <= x1; ++x)
          run(start[16 * x + 4 * y0], start[16 * (x + more) + 4 * y1 + 4]);
      }
    }
  }
}

// Calls each(begin, count) for each register of those sorted balls, after all of a hundred were asked for: so
// that no branch waits for memory.
template <class Each>
FIRN_INLINE void for_each_register_in(const TraceGrid& grid, const int low[3], const int high[3],
                                      Each&& each) {
  constexpr int kMost = 128;
  struct {
    std::uint32_t begin;
    int count;
  } registers[kMost];
  int n = 0;
  const auto call = [&]() FIRN_INLINE_LAMBDA {
    for (int i = 0; i < n; ++i) each(registers[i].begin, registers[i].count);
    n = 0;
  };
  for_each_long_run(grid, low, high, [&](std::uint32_t begin, std::uint32_t end) {
    for (; begin < end; begin += kLanes) {
      __builtin_prefetch(grid.x + begin);
      __builtin_prefetch(grid.y + begin);
      __builtin_prefetch(grid.z + begin);
      registers[n++] = {begin, end - begin < kLanes ? static_cast<int>(end - begin) : kLanes};
      if (n == kMost) call();
    }
  });
  call();
}

FIRN_INLINE int cells_reached(const TraceGrid& grid) {
  return static_cast<int>(grid.max_radius * grid.inv_cell + kCellMargin) + 1;
}

// The part of the squared distance from balls at p to the cell between low and high that one axis makes up.
FIRN_INLINE Floats gap2(Floats p, float low, float high) {
  const Floats gap = max(max(low - p, p - high), splat(0));
  return gap * gap;
}

// The cell's word after this call; kNoList where it cannot have a list.
inline std::uint32_t make_list(const TraceGrid& grid, std::size_t place, const int cell[3]) {
  std::uint32_t word = kUnlisted;
  if (!__atomic_compare_exchange_n(&grid.list[place], &word, kNoList, false, __ATOMIC_ACQUIRE,
                                   __ATOMIC_ACQUIRE))
    return word;
  constexpr std::size_t kMost = kMostListed;
  std::uint32_t found[kMost + 2 * kLanes];
  std::size_t count = 0;
  const float margin = kCellMargin * grid.cell;
  const int reached = cells_reached(grid);
  int low[3], high[3];
  float from[3], to[3];  // m, the cell
  for (int a = 0; a < 3; ++a) {
    low[a] = cell[a] > reached ? cell[a] - reached : 0;
    high[a] = cell[a] + reached < grid.cells[a] ? cell[a] + reached : grid.cells[a] - 1;
    from[a] = static_cast<float>(cell[a]) * grid.cell;
    to[a] = from[a] + grid.cell;
  }
  for_each_long_run(grid, low, high, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t b = begin; b < end && count <= kMost; b += kLanes) {
      const int some = end - b < kLanes ? static_cast<int>(end - b) : kLanes;
      const Floats reach = radii(grid, b, some) + margin;
      const Floats distance2 = gap2(load_first(grid.x + b, some, 0.f), from[0], to[0]) +
                               gap2(load_first(grid.y + b, some, 0.f), from[1], to[1]) +
                               gap2(load_first(grid.z + b, some, 0.f), from[2], to[2]);
      const Mask in = less_equal(distance2, reach * reach) & less(splat(margin), reach) & mask_of_first(some);
      store_packed(reinterpret_cast<std::int32_t*>(found + count), in,
                   lane_numbers() + static_cast<std::int32_t>(b));
      count += static_cast<std::size_t>(__builtin_popcount(static_cast<unsigned>(lane_bits(in))));
    }
  });
  if (count > kMost) return kNoList;
  word = 0;
  if (count > 0) {
    const std::size_t columns = grid.radius == nullptr ? 4 : 5;
    const std::uint64_t units = (columns * count + kListUnit - 1) / kListUnit;
    const std::uint64_t first = __atomic_fetch_add(grid.units_used, units, __ATOMIC_RELAXED);
    if (first + units > grid.list_room) return kNoList;
    float* out = grid.lists + first * kListUnit;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t b = found[i];
      out[i] = grid.x[b];
      out[count + i] = grid.y[b];
      out[2 * count + i] = grid.z[b];
      __builtin_memcpy(out + 3 * count + i, &b, sizeof b);
      if (columns == 5) out[4 * count + i] = grid.radius[b] * grid.radius[b];
    }
    word = static_cast<std::uint32_t>(first << 8 | count);
  }
  __atomic_store_n(&grid.list[place], word, __ATOMIC_RELEASE);
  return word;
}

// The cell's word, after its list was made if nobody had asked for it.
FIRN_INLINE std::uint32_t find_list(const TraceGrid& grid, std::size_t place, const int cell[3]) {
  const std::uint32_t word = __atomic_load_n(&grid.list[place], __ATOMIC_ACQUIRE);
  return word == kUnlisted ? make_list(grid, place, cell) : word;
}

// Lanes whose points p (m, in the grid) lie in a ball. Asked of the few cells that balls reach them from, by
// centre; all that is to be read is asked for first, for points may lie far apart.
inline Mask in_balls(const TraceGrid& grid, Mask lanes, const Floats p[3]) {
  constexpr int kMostRuns = 8 * kLanes;
  struct {
    std::uint32_t begin, end;
    int lane;
  } runs[kMostRuns];
  int count = 0, in = 0;
  float at[3][kLanes];
  for (int a = 0; a < 3; ++a) store(at[a], p[a]);
  const auto test_runs = [&] {
    for (int k = 0; k < count; ++k) {
      const int lane = runs[k].lane;
      for (std::uint32_t b = runs[k].begin; b < runs[k].end && (in >> lane & 1) == 0; b += kLanes) {
        const int some = runs[k].end - b < kLanes ? static_cast<int>(runs[k].end - b) : kLanes;
        const Floats x = load_first(grid.x + b, some, 0.f) - at[0][lane],
                     y = load_first(grid.y + b, some, 0.f) - at[1][lane],
                     z = load_first(grid.z + b, some, 0.f) - at[2][lane], r = radii(grid, b, some);
        if (any(less_equal(fma(x, x, fma(y, y, z * z)), r * abs(r)))) in |= 1 << lane;
      }
    }
    count = 0;
  };
  const float reach = grid.max_radius + kCellMargin * grid.cell;
  for (int left = lane_bits(lanes); left != 0; left &= left - 1) {
    const int lane = __builtin_ctz(static_cast<unsigned>(left));
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      const float from = (at[a][lane] - reach) * grid.inv_cell, to = (at[a][lane] + reach) * grid.inv_cell;
      low[a] = from > 0 ? static_cast<int>(from) : 0;
      high[a] = to < static_cast<float>(grid.cells[a]) ? static_cast<int>(to) : grid.cells[a] - 1;
    }
    for_each_run(grid, low, high, [&](std::uint32_t begin, std::uint32_t end) {
      const float* const columns[3] = {grid.x, grid.y, grid.z};
      for (const float* column : columns) {
        __builtin_prefetch(column + begin);
        __builtin_prefetch(column + end - 1);
      }
      runs[count++] = {begin, end, lane};
      if (count == kMostRuns) test_runs();
    });
  }
  test_runs();
  return mask_of_bits(in);
}

// One ray against all balls that overlap a cell.
template <bool kAny>
FIRN_INLINE void test_cell(const TraceGrid& grid, std::size_t place, const int cell[3], const Ray& ray,
                           Nearest& best) {
  const std::uint32_t word = find_list(grid, place, cell);
  if (word == kNoList) {
    for_each_run_around(grid, cell, cells_reached(grid), [&](std::uint32_t begin, std::uint32_t end) {
      test_run(grid, begin, end, ray, best);
    });
  } else {
    test_list<kAny>(grid, word, ray, best);
  }
}

}  // namespace firn::kernels::FIRN_ISA
