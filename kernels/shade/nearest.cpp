// SPDX-License-Identifier: MIT
// The nearest particle of each point, sixteen points at a time: the cells around them are much the same, so
// each particle there is broadcast against all. The cells that hold the points come first; how far off the
// nearest is there bounds what else must be read. Points that lie too far apart are halved.
#include "kernels/shade/table.h"
#include "kernels/simd/lanes.h"
#include "kernels/trace/cell_list.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr int kGroup = 16;              // points
constexpr float kWidest = 2;            // cells across a group
constexpr float kRounding = 1 + 1e-5f;  // of distances

struct Cells {
  int low[3], high[3];
};

class Group {
 public:
  static constexpr int kParts = kGroup / kLanes;

  Group(const TraceGrid& grid, const Columns3& point, std::size_t begin, int count)
      : grid_(grid), begin_(begin), count_(count) {
    for (int a = 0; a < 3; ++a) {
      const float first = point.at[a][begin];
      Floats least = splat(first), most = least;
      for (int part = 0; part < kParts; ++part) {
        const int some = count > part * kLanes ? count - part * kLanes : 0;
        p_[a][part] = load_first(point.at[a] + begin + part * kLanes, some, first);
        least = min(least, p_[a][part]), most = max(most, p_[a][part]);
      }
      low_[a] = -greatest_lane(-least), high_[a] = greatest_lane(most);
    }
    for (int part = 0; part < kParts; ++part) {
      best_[part] = splat(grid.cell * grid.cell);
      particle_[part] = splat_int(-1);
    }
  }

  bool wide() const {
    float most = 0;
    for (int a = 0; a < 3; ++a) most = high_[a] - low_[a] > most ? high_[a] - low_[a] : most;
    return most > kWidest * grid_.cell;
  }

  FIRN_INLINE void search() {
    const Cells own = cells_within(0);
    for (int x = own.low[0]; x <= own.high[0]; ++x) {
      for (int y = own.low[1]; y <= own.high[1]; ++y) test_row(x, y, own.low[2], own.high[2]);
    }
    Floats furthest = best_[0];
    for (int part = 1; part < kParts; ++part) furthest = max(furthest, best_[part]);
    const float reach2 = greatest_lane(furthest) * kRounding;
    const Cells all = cells_within(__builtin_sqrtf(reach2) * kRounding);
    for (int x = all.low[0]; x <= all.high[0]; ++x) {
      for (int y = all.low[1]; y <= all.high[1]; ++y) {
        if (gap2(0, x) + gap2(1, y) > reach2) continue;
        if (x < own.low[0] || x > own.high[0] || y < own.low[1] || y > own.high[1]) {
          test_row(x, y, all.low[2], all.high[2]);
        } else {
          test_row(x, y, all.low[2], own.low[2] - 1);
          test_row(x, y, own.high[2] + 1, all.high[2]);
        }
      }
    }
  }

  FIRN_INLINE void store_particles(std::uint32_t* particle) const {
    for (int part = 0; part < kParts; ++part) {
      if (count_ <= part * kLanes) break;
      store_first(reinterpret_cast<std::int32_t*>(particle + begin_) + part * kLanes, count_ - part * kLanes,
                  particle_[part]);
    }
  }

 private:
  // Those that the points' box, widened by `reach` (m), touches.
  FIRN_INLINE Cells cells_within(float reach) const {
    Cells cells;
    for (int a = 0; a < 3; ++a) {
      const auto last = static_cast<float>(grid_.cells[a] - 1);
      const auto cell = [&](float p) {
        const float at = p * grid_.inv_cell;
        return static_cast<int>(at > 0 ? (at < last ? at : last) : 0);
      };
      cells.low[a] = cell(low_[a] - reach), cells.high[a] = cell(high_[a] + reach);
    }
    return cells;
  }
  // m^2, the part of the squared distance from the box to the cells at `cell` that the axis makes up.
  FIRN_INLINE float gap2(int a, int cell) const {
    const float from = static_cast<float>(cell) * grid_.cell, to = from + grid_.cell;
    const float gap = from > high_[a] ? from - high_[a] : low_[a] > to ? low_[a] - to : 0;
    return gap * gap;
  }

  FIRN_INLINE void test_row(int x, int y, int first, int last) {
    for (int z = first; z <= last;) {
      const int end = (z | 3) < last ? (z | 3) : last;  // in this brick: one run
      const std::int32_t slot = grid_.slot[brick_at(grid_, x >> 2, y >> 2, z >> 2)];
      if (slot >= 0) {
        const std::size_t place = cell_at(slot, x, y, z);
        test_run(grid_.cell_start[place], grid_.cell_start[place + static_cast<std::size_t>(end - z) + 1]);
      }
      z = end + 1;
    }
  }

  FIRN_INLINE void test_run(std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t b = begin; b < end; ++b) {
      const Floats x = splat(grid_.x[b]), y = splat(grid_.y[b]), z = splat(grid_.z[b]);
      const Ints index = splat_int(static_cast<std::int32_t>(b));
      for (int part = 0; part < kParts; ++part) {
        const Floats dx = x - p_[0][part], dy = y - p_[1][part], dz = z - p_[2][part];
        const Floats distance2 = fma(dz, dz, fma(dy, dy, dx * dx));
        // Flipping the sign bit orders unsigned indices as signed ones.
        const Mask lower = less(index ^ INT32_MIN, particle_[part] ^ INT32_MIN);
        const Mask nearer = less(distance2, best_[part]) | (less_equal(distance2, best_[part]) & lower);
        best_[part] = select(nearer, distance2, best_[part]);
        particle_[part] = select(nearer, index, particle_[part]);
      }
    }
  }

  const TraceGrid& grid_;
  std::size_t begin_;
  int count_;
  Floats p_[3][kParts];     // m
  Floats best_[kParts];     // m^2
  Ints particle_[kParts];   // the bits of a sorted index
  float low_[3], high_[3];  // m, of all points
};

void search(const TraceGrid& grid, const Columns3& point, std::size_t begin, int count,
            std::uint32_t* particle) {
  Group group(grid, point, begin, count);
  if (count > 1 && group.wide()) {
    search(grid, point, begin, count / 2, particle);
    search(grid, point, begin + static_cast<std::size_t>(count / 2), count - count / 2, particle);
    return;
  }
  group.search();
  group.store_particles(particle);
}

}  // namespace

void nearest(const TraceGrid& grid, const Columns3& point, std::size_t begin, std::size_t end,
             std::uint32_t* particle) {
  for (std::size_t i = begin; i < end; i += kGroup)
    search(grid, point, i, static_cast<int>(end - i < kGroup ? end - i : kGroup), particle);
}

}  // namespace firn::kernels::FIRN_ISA
