// SPDX-License-Identifier: MIT
// Coherent rays, a register of them at a time (Wald et al. 2006, "Ray tracing animated scenes using coherent
// grid traversal"): the packet walks the grid slice by slice along its main axis. In each slice the rays'
// common bounds, widened by the largest radius, name the cells whose balls can be met; each ball is broadcast
// against the rays.
//
//     slice k          rays     o---->---------      Lists by centre do here: each ball is tested once a
//     packet,
//     +---+---+---+        o---->---------           where lists by overlap would test it once a cell.
//     |   |###|###|  <- cells within the bounds
//
// Rays that are not coherent (signs differ, or the bounds grow wide) go one by one through stream.cpp.
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // stream.cpp

namespace {

constexpr long kWidestSlice = 48;      // cells; beyond it single rays are cheaper
constexpr float kMinMainShare = 0.4f;  // of every direction along the main axis
constexpr float kFar = 3e38f;
constexpr float kMargin = 1e-3f;  // cells: covers the rounding of the bounds

struct Packet {
  Floats o[3], d[3];  // m; origins moved to the grid's edge
  Floats inv_main;    // 1 / direction along the main axis
  Floats best;        // m from the moved origin; negative: not in the grid
  Ints particle;      // the bits of a sorted index
  double entry[kLanes];
  int main;  // axis
  bool forward;
};

struct Range {
  int low[3], high[3];  // cells, inclusive
  bool empty;
};

// Of the lanes in m.
FIRN_INLINE float lowest_of(Mask m, Floats v) { return -largest_lane(select(m, -v, splat(-kFar))); }
FIRN_INLINE float highest_of(Mask m, Floats v) { return largest_lane(select(m, v, splat(-kFar))); }
FIRN_INLINE Mask live(const Packet& packet) { return less_equal(splat(0), packet.best); }

// Chooses the axis that the rays go along most; false if they do not all go the same way.
bool choose_main(Packet& packet) {
  const int lanes = lane_bits(live(packet));
  const int first = __builtin_ctz(static_cast<unsigned>(lanes));
  const auto size = [&](int a) { return __builtin_fabsf(packet.d[a][first]); };
  packet.main = size(0) > size(1) ? (size(0) > size(2) ? 0 : 2) : (size(1) > size(2) ? 1 : 2);
  const Floats along = packet.d[packet.main];
  packet.forward = along[first] > 0;
  packet.inv_main = splat(1) / along;
  return (lane_bits(less(splat(kMinMainShare), packet.forward ? along : -along)) & lanes) == lanes;
}

// Strays first, then each ray moved to the grid; false if no ray meets it.
bool load_packet(const TraceGrid& grid, const RayView& rays, std::size_t begin, Packet& packet) {
  float o[3][kLanes], d[3][kLanes], best[kLanes];
  bool some = false;
  for (int lane = 0; lane < kLanes; ++lane) {
    const std::size_t i = begin + lane;
    Ray ray = load_ray(rays, i);
    Nearest stray{rays.t[i], kNoHit};
    test_bundles<false>(grid.strays, 0, grid.stray_bundles, ray, stray);
    rays.t[i] = stray.t;
    rays.hit[i] = stray.particle;
    packet.entry[lane] = 0;
    const bool inside = enter_grid(grid, ray, stray.t, packet.entry[lane]);
    some |= inside;
    for (int a = 0; a < 3; ++a) o[a][lane] = ray.o[a], d[a][lane] = ray.d[a];
    best[lane] = inside ? static_cast<float>(stray.t - packet.entry[lane]) : -1.f;
  }
  for (int a = 0; a < 3; ++a) packet.o[a] = load(o[a]), packet.d[a] = load(d[a]);
  packet.best = load(best);
  packet.particle = splat_int(-1);
  return some;
}

// The cells, from `first` to `last` along the main axis, where balls can lie that the packet meets in
// between.
Range reachable(const TraceGrid& grid, const Packet& packet, int first, int last, float reach) {
  const int m = packet.main;
  const Floats low_t = (splat(static_cast<float>(first) * grid.cell - reach) - packet.o[m]) * packet.inv_main;
  const Floats high_t =
      (splat(static_cast<float>(last + 1) * grid.cell + reach) - packet.o[m]) * packet.inv_main;
  const Floats t_in = max(packet.forward ? low_t : high_t, splat(0));
  const Floats t_out = min(packet.forward ? high_t : low_t, packet.best);
  const Mask here = less_equal(t_in, t_out);
  Range range;
  range.empty = !any(here);
  range.low[m] = first, range.high[m] = last;
  for (int a = 0; a < 3 && !range.empty; ++a) {
    if (a == m) continue;
    const Floats p = fma(packet.d[a], t_in, packet.o[a]), q = fma(packet.d[a], t_out, packet.o[a]);
    const float low = (lowest_of(here, min(p, q)) - reach) * grid.inv_cell;
    const float high = (highest_of(here, max(p, q)) + reach) * grid.inv_cell;
    const auto cells = static_cast<float>(grid.cells[a]);
    range.empty = high < 0 || low >= cells;
    range.low[a] = low > 0 ? static_cast<int>(low) : 0;
    range.high[a] = high < cells ? static_cast<int>(high) : grid.cells[a] - 1;
  }
  return range;
}

FIRN_INLINE void test_ball(const TraceGrid& grid, std::uint64_t ball, Packet& packet) {
  const Floats c[3] = {grid.x[ball] - packet.o[0], grid.y[ball] - packet.o[1], grid.z[ball] - packet.o[2]};
  Floats along;
  const Floats depth2 = project(c, packet.d, splat(grid.radius[ball] * grid.radius[ball]), along);
  if (!any(less_equal(splat(0), depth2))) return;
  const Floats t = along - sqrt(depth2);
  const Ints index = splat_int(static_cast<std::int32_t>(ball));
  // Flipping the sign bit orders unsigned indices as signed ones.
  const Mask lower = less(index ^ INT32_MIN, packet.particle ^ INT32_MIN);
  const Mask nearer = less(splat(0), t) & (less(t, packet.best) | (less_equal(t, packet.best) & lower));
  packet.best = select(nearer, t, packet.best);
  packet.particle = select(nearer, index, packet.particle);
}

void test_cells(const TraceGrid& grid, const Range& range, Packet& packet) {
  for (int x = range.low[0]; x <= range.high[0]; ++x) {
    for (int y = range.low[1]; y <= range.high[1]; ++y) {
      for (int z = range.low[2]; z <= range.high[2]; ++z) {
        const std::int32_t slot = grid.slot[brick_at(grid, x >> 2, y >> 2, z >> 2)];
        if (slot < 0) continue;
        const std::size_t cell = cell_at(slot, x, y, z);
        for (std::uint32_t b = grid.cell_start[cell]; b < grid.cell_start[cell + 1]; ++b)
          test_ball(grid, b, packet);
      }
    }
  }
}

bool has_bricks(const TraceGrid& grid, const Range& range) {
  for (int x = range.low[0] >> 2; x <= range.high[0] >> 2; ++x) {
    for (int y = range.low[1] >> 2; y <= range.high[1] >> 2; ++y) {
      for (int z = range.low[2] >> 2; z <= range.high[2] >> 2; ++z) {
        if (grid.slot[brick_at(grid, x, y, z)] >= 0) return true;
      }
    }
  }
  return false;
}

long size_of(const Range& range) {
  long cells = 1;
  for (int a = 0; a < 3; ++a) cells *= range.high[a] - range.low[a] + 1;
  return cells;
}

// The slab of bricks behind the first one that balls met by the packet can lie in.
int first_slab(const TraceGrid& grid, const Packet& packet, float reach) {
  const int m = packet.main;
  const float at = packet.forward ? lowest_of(live(packet), packet.o[m]) - reach
                                  : highest_of(live(packet), packet.o[m]) + reach;
  const int cell = at > 0 ? static_cast<int>(at * grid.inv_cell) : 0;
  return (cell < grid.cells[m] ? cell : grid.cells[m] - 1) >> 2;
}

// False if the packet grew too wide on its way; what it has found so far stands.
bool walk_slabs(const TraceGrid& grid, Packet& packet) {
  const int m = packet.main, step = packet.forward ? 1 : -1;
  const float reach = grid.max_radius + kMargin * grid.cell;
  for (int slab = first_slab(grid, packet, reach); slab >= 0 && slab < grid.bricks[m]; slab += step) {
    const Range bricks =
        reachable(grid, packet, slab * kBrickCells, slab * kBrickCells + kBrickCells - 1, reach);
    if (bricks.empty) {
      const float plane = static_cast<float>((slab + (packet.forward ? 0 : 1)) * kBrickCells) * grid.cell;
      const Floats t = (splat(plane - static_cast<float>(step) * reach) - packet.o[m]) * packet.inv_main;
      if (!any(less_equal(t, packet.best))) return true;
      continue;
    }
    if (size_of(bricks) > kBrickCells * kBrickCells * kWidestSlice) return false;
    if (!has_bricks(grid, bricks)) continue;
    for (int i = 0; i < kBrickCells; ++i) {
      const int k = slab * kBrickCells + (packet.forward ? i : kBrickCells - 1 - i);
      const Range slice = reachable(grid, packet, k, k, reach);
      if (slice.empty) continue;
      if (size_of(slice) > kWidestSlice) return false;
      test_cells(grid, slice, packet);
    }
  }
  return true;
}

void trace_packet(const TraceGrid& grid, const RayView& rays, std::size_t begin) {
  Packet packet;
  if (!load_packet(grid, rays, begin, packet)) return;
  if (!choose_main(packet) || !walk_slabs(grid, packet)) {
    // A stray that shortened a ray is found again: it lies within the reach.
    closest(grid, rays, begin, begin + kLanes);
    return;
  }
  float best[kLanes];
  std::int32_t particle[kLanes];
  store(best, packet.best);
  store(particle, packet.particle);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (particle[lane] == -1) continue;
    rays.t[begin + lane] = static_cast<float>(packet.entry[lane] + best[lane]);
    rays.hit[begin + lane] = static_cast<std::uint32_t>(particle[lane]);
  }
}

}  // namespace

void closest_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  for (; begin + kLanes <= end; begin += kLanes) trace_packet(grid, rays, begin);
  closest(grid, rays, begin, end);
}

}  // namespace firn::kernels::FIRN_ISA
