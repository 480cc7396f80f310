// SPDX-License-Identifier: MIT
// Coherent rays that go through the grid together (after Wald et al. 2006, "Ray tracing animated scenes using
// coherent grid traversal"): a register of rays is a packet, and as many packets as a register has lanes are
// a beam. It walks along the axis that its rays go along most, a slab of bricks at a time. The common bounds
// of the packets name the cells to look into; what is in those, the bounds of each packet leave to its rays.
//
//     slab of bricks
//     +---+---+---+   o---->---------  \  packet: bounds are planes beside the main axis, drawn
//     |   |###|###|   o---->---------  /  anew when some of its rays were shortened
//     +---+---+---+   o---->---------  \  packet
//     |###|###|###|   o---->---------  /                       ###: cells within the beam's bounds
//
// A beam that is much wider than its packets, since there is much between them, is split. Wide packets go by
// other ways.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr int kPackets = kLanes;       // of a beam, at most
inline constexpr float kMinMainShare = 0.4f;  // of every direction along the main axis
inline constexpr float kTelling = 1.f / 32;   // a packet's time to tell what a cell holds, of looking into it
inline constexpr float kFar = 3e38f;
inline constexpr float kBlocked = -2;  // m, of rays that something blocks: a reach of less than nothing

using Packets = std::uint32_t;  // a set of them, a bit each

template <class Body>
FIRN_INLINE void for_each_packet(Packets packets, Body&& body) {
  for (; packets != 0; packets &= packets - 1) body(__builtin_ctz(packets));
}

// Which way a beam goes: along the main axis, counted up in its direction.
struct Heading {
  int main, side[2];  // axes
  bool forward;

  FIRN_INLINE Floats along(Floats x) const { return forward ? x : -x; }
};

// Cells, both ends are in it.
struct CellRange {
  int low[3], high[3];
};

// Bounds beside the main axis: at the plane `from` across it, and per metre along it. T: a float, or a lane
// for each packet of a beam.
template <class T>
struct Bounds {
  T from;             // m
  T low[2], high[2];  // m, of each axis beside the main one
  T low_slope[2], high_slope[2];
};

// Derived has
// * kCellsPerRay, as TraceGrid's cells_per_ray, beyond which a packet declines
// * void set_aside(int p): may take rays of a packet out that begin where the beam cannot follow them
// * Packets meet(int slab, Packets, const Bounds<float>& hull, const CellRange&): tests what the cells hold,
//   which are of the four slices from `slab` on, against these packets and has them shorten(p) when something
//   was found; returns those that decline
template <class Derived, bool kAny>
class Beam {
 public:
  // `count` packets of the rays from `begin` on. Returns those that are not coherent, or are or grow too wide
  // (TraceGrid), or decline: nothing is found for their rays (a stray that shortened a ray is found again,
  // within its reach).
  Packets trace(std::size_t begin, int count);

 protected:
  // reach: m, from what is met to its place in the grid.
  Beam(const TraceGrid& grid, const RayView& rays, float reach) : grid_(grid), rays_(rays), reach_(reach) {}

  FIRN_INLINE Mask live(int p) const { return less_equal(splat(0), best_[p]); }
  // The coordinate along the main axis at the k-th cell that the rays come to.
  FIRN_INLINE float plane(int k) const {
    return static_cast<float>(heading_.forward ? k : k - grid_.cells[heading_.main]) * grid_.cell;
  }
  // How far a packet reaches, once rays of it have found something.
  FIRN_INLINE void shorten(int p) {
    furthest_[p] = greatest_lane(select(live(p), fma(best_[p], speed_[p], start_[p]), splat(-kFar)));
    shortened_ |= 1u << p;
  }
  FIRN_INLINE Bounds<Floats> bounds() const;
  FIRN_INLINE Bounds<float> bounds_of(int p) const {
    return {from_[p],
            {low_[0][p], low_[1][p]},
            {high_[0][p], high_[1][p]},
            {low_slope_[0][p], low_slope_[1][p]},
            {high_slope_[0][p], high_slope_[1][p]}};
  }

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t begin_ = 0;
  float reach_;  // m
  Heading heading_;
  Floats o_[3][kPackets], d_[3][kPackets];  // m; origins moved to the grid's edge
  Floats entry_[kPackets];                  // m, from the ray's origin to the moved one
  Floats best_[kPackets];                   // m from the moved origin; negative: not in the grid
  Ints particle_[kPackets];  // the bits of a sorted index, kSurfaceHit or kNoHit; not of any hits
  // Of each packet, along the main axis: where its bounds begin and how far its rays reach.
  float from_[kLanes] = {}, furthest_[kLanes] = {};

 private:
  Derived& self() { return *static_cast<Derived*>(this); }
  std::size_t first_ray(int p) const { return begin_ + static_cast<std::size_t>(p) * kLanes; }
  std::int32_t* hits(int p) const { return reinterpret_cast<std::int32_t*>(rays_.hit + first_ray(p)); }
  void load_rays(int p);
  Packets heading_along(Packets packets);
  void draw_bounds(Packets packets, float from);
  void walk(Packets packets, int slab);
  Bounds<float> hull_of(Packets& packets, float& near, float& far, Floats& area) const;
  bool cells_of(const Bounds<float>& hull, float to, int slab, CellRange& cells) const;
  int clearance(const CellRange& cells) const;
  float steepest(Packets packets) const;
  void store_hits(int p) const;

  // The coordinate along the main axis, which counts up in the rays' direction: where rays begin, its growth
  // a metre of the ray, and how far they go aside a metre of it.
  Floats start_[kPackets], speed_[kPackets], tilt_[2][kPackets];
  float low_[2][kLanes] = {}, high_[2][kLanes] = {}, low_slope_[2][kLanes] = {}, high_slope_[2][kLanes] = {};
  Packets shortened_ = 0;  // since their bounds were drawn
  Packets declined_ = 0;
};

template <class Derived, bool kAny>
Packets Beam<Derived, kAny>::trace(std::size_t begin, int count) {
  begin_ = begin;
  Packets going = 0;
  declined_ = 0;
  for (int p = 0; p < count; ++p) {
    load_rays(p);
    self().set_aside(p);
    if (any(live(p))) going |= 1u << p;
  }
  while (going != 0) {
    const Packets same = heading_along(going);
    going &= ~same;
    const Packets packets = same & ~declined_;
    if (packets == 0) continue;
    float least = kFar;
    for_each_packet(packets, [&](int p) { least = from_[p] < least ? from_[p] : least; });
    const float first = least - reach_ - plane(0);
    walk(packets, first > 0 ? static_cast<int>(first * grid_.inv_cell) & ~3 : 0);
  }
  for (int p = 0; p < count; ++p) {
    if ((declined_ >> p & 1) == 0) store_hits(p);
  }
  return declined_;
}

template <class Derived, bool kAny>
void Beam<Derived, kAny>::load_rays(int p) {
  const std::size_t from = first_ray(p);
  const Ints none = splat_int(static_cast<std::int32_t>(kNoHit));
  store(hits(p), none);
  for (std::size_t i = from; i < from + kLanes && grid_.stray_bundles > 0; ++i) {
    Nearest stray{rays_.t[i], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, i), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[i] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[i] = stray.t;
  }
  constexpr int kNext = kPackets * kLanes;
  Floats o[3], d[3], moved[3];
  for (int a = 0; a < 3; ++a) {
    o[a] = load(rays_.origin[a] + from);
    d_[a][p] = d[a] = load(rays_.direction[a] + from);
    __builtin_prefetch(rays_.origin[a] + from + kNext);
    __builtin_prefetch(rays_.direction[a] + from + kNext);
  }
  __builtin_prefetch(rays_.t + from + kNext);
  entry_[p] = enter_grid(grid_, o, d, load(rays_.t + from), moved, best_[p]);
  for (int a = 0; a < 3; ++a) o_[a][p] = moved[a];
  particle_[p] = none;
  if (kAny) best_[p] = select(equal(load(hits(p)), none), best_[p], splat(kBlocked));
}

// Chooses the axis that the first of the packets goes along most, and takes those that go along it the same
// way. Declines those whose rays do not all do so.
template <class Derived, bool kAny>
Packets Beam<Derived, kAny>::heading_along(Packets packets) {
  const auto main_of = [&](int p, bool& forward) {
    const int first = __builtin_ctz(static_cast<unsigned>(lane_bits(live(p))));
    const auto size = [&](int a) { return __builtin_fabsf(d_[a][p][first]); };
    const int main = size(0) > size(1) ? (size(0) > size(2) ? 0 : 2) : (size(1) > size(2) ? 1 : 2);
    forward = d_[main][p][first] > 0;
    return main;
  };
  heading_.main = main_of(__builtin_ctz(packets), heading_.forward);
  heading_.side[0] = heading_.main == 0 ? 1 : 0;
  heading_.side[1] = heading_.main == 2 ? 1 : 2;
  Packets same = 0;
  for_each_packet(packets, [&](int p) {
    bool forward;
    if (main_of(p, forward) != heading_.main || forward != heading_.forward) return;
    same |= 1u << p;
    start_[p] = heading_.along(o_[heading_.main][p]);
    speed_[p] = heading_.along(d_[heading_.main][p]);
    if (any(live(p) & !less(splat(kMinMainShare), speed_[p]))) {
      declined_ |= 1u << p;
      return;
    }
    const Floats per_metre = splat(1) / speed_[p];
    for (int side = 0; side < 2; ++side) tilt_[side][p] = d_[heading_.side[side]][p] * per_metre;
  });
  draw_bounds(same & ~declined_, -kFar);
  return same;
}

// Around the rays of these packets that reach beyond `from` along the main axis. A bound on the way from one
// plane to another is linear, since every ray is.
template <class Derived, bool kAny>
void Beam<Derived, kAny>::draw_bounds(Packets packets, float from) {
  const float edge = heading_.forward ? grid_.cell * static_cast<float>(grid_.cells[heading_.main]) : 0;
  Mask ahead[kPackets];
  Floats nearest[kPackets], furthest[kPackets];
  for_each_packet(packets, [&](int p) {
    const Floats end = fma(best_[p], speed_[p], start_[p]);
    ahead[p] = live(p) & less_equal(splat(from), end);
    nearest[p] = select(ahead[p], -start_[p], splat(-kFar));
    furthest[p] = select(ahead[p], end, splat(-kFar));
  });
  const Floats reached = greatest_of_each(furthest), begin = max(-greatest_of_each(nearest), splat(from));
  const Floats to = max(min(reached, splat(edge)), begin + grid_.cell), per_metre = splat(1) / (to - begin);
  const Mask drawn = mask_of_bits(static_cast<int>(packets));
  const auto note = [&](float* lanes, Floats a) { store(lanes, select(drawn, a, load(lanes))); };
  note(from_, begin);
  note(furthest_, reached);
  float to_of[kLanes];
  store(to_of, to);
  for (int side = 0; side < 2; ++side) {
    Floats low[2][kPackets], high[2][kPackets];
    for_each_packet(packets, [&](int p) {
      for (int end = 0; end < 2; ++end) {
        const Floats way = splat(end == 0 ? from_[p] : to_of[p]) - start_[p];
        const Floats at = fma(way, tilt_[side][p], o_[heading_.side[side]][p]);
        low[end][p] = select(ahead[p], -at, splat(-kFar));
        high[end][p] = select(ahead[p], at, splat(-kFar));
      }
    });
    const Floats low_here = -greatest_of_each(low[0]), high_here = greatest_of_each(high[0]);
    const Floats low_slope = (-greatest_of_each(low[1]) - low_here) * per_metre,
                 high_slope = (greatest_of_each(high[1]) - high_here) * per_metre;
    const auto across = [&](Floats slope) { return reach_ * sqrt(fma(slope, slope, splat(1))); };
    note(low_slope_[side], low_slope);
    note(high_slope_[side], high_slope);
    note(low_[side], low_here - across(low_slope));
    note(high_[side], high_here + across(high_slope));
  }
  shortened_ &= ~packets;
}

template <class Derived, bool kAny>
FIRN_INLINE Bounds<Floats> Beam<Derived, kAny>::bounds() const {
  return {load(from_),
          {load(low_[0]), load(low_[1])},
          {load(high_[0]), load(high_[1])},
          {load(low_slope_[0]), load(low_slope_[1])},
          {load(high_slope_[0]), load(high_slope_[1])}};
}

// Around these packets from the plane `near` to the plane `far`, which are moved to where there are any;
// those that are too wide are taken out. area: the cells across that each of them alone would look into.
template <class Derived, bool kAny>
Bounds<float> Beam<Derived, kAny>::hull_of(Packets& packets, float& near, float& far, Floats& area) const {
  const Bounds<Floats> b = bounds();
  Mask here = mask_of_bits(static_cast<int>(packets));
  const float least = -greatest_lane(select(here, -b.from, splat(-kFar))) - reach_,
              last = greatest_lane(select(here, load(furthest_), splat(-kFar))) + reach_;
  near = least > near ? least : near;
  far = last < far ? last : far;
  far = far > near + 0.01f * grid_.cell ? far : near + 0.01f * grid_.cell;
  Floats low[2][2], high[2][2], section = splat(1);
  area = splat(1);
  for (int side = 0; side < 2; ++side) {
    for (int end = 0; end < 2; ++end) {
      const Floats way = splat(end == 0 ? near : far) - b.from;
      low[side][end] = fma(way, b.low_slope[side], b.low[side]);
      high[side][end] = fma(way, b.high_slope[side], b.high[side]);
    }
    const auto cells = [&](Floats width) { return fma(width, splat(grid_.inv_cell), splat(1)); };
    section = section * cells(max(high[side][0] - low[side][0], high[side][1] - low[side][1]));
    area = area * cells(max(high[side][0], high[side][1]) - min(low[side][0], low[side][1]));
  }
  const float most = grid_.cells_per_ray > 0 ? grid_.cells_per_ray : Derived::kCellsPerRay;
  here = here & less_equal(section, splat(most * kLanes));
  packets = static_cast<Packets>(lane_bits(here));
  Bounds<float> hull;
  hull.from = near;
  for (int side = 0; side < 2; ++side) {
    const auto least_of = [&](Floats a) { return -greatest_lane(select(here, -a, splat(-kFar))); };
    const auto most_of = [&](Floats a) { return greatest_lane(select(here, a, splat(-kFar))); };
    hull.low[side] = least_of(low[side][0]);
    hull.high[side] = most_of(high[side][0]);
    hull.low_slope[side] = (least_of(low[side][1]) - hull.low[side]) / (far - near);
    hull.high_slope[side] = (most_of(high[side][1]) - hull.high[side]) / (far - near);
  }
  return hull;
}

// The cells of the slab within the hull, which ends at the plane `to`; false if there are none.
template <class Derived, bool kAny>
bool Beam<Derived, kAny>::cells_of(const Bounds<float>& hull, float to, int slab, CellRange& cells) const {
  int first = static_cast<int>((hull.from - plane(0)) * grid_.inv_cell),
      last = static_cast<int>((to - plane(0)) * grid_.inv_cell);
  first = first > slab ? first : slab;
  last = last < slab + kBrickCells - 1 ? last : slab + kBrickCells - 1;
  last = last > first ? last : first;
  cells.low[heading_.main] = heading_.forward ? first : grid_.cells[heading_.main] - 1 - last;
  cells.high[heading_.main] = heading_.forward ? last : grid_.cells[heading_.main] - 1 - first;
  const float length = to - hull.from;
  for (int side = 0; side < 2; ++side) {
    const float low = hull.low[side] + (hull.low_slope[side] < 0 ? length * hull.low_slope[side] : 0),
                high = hull.high[side] + (hull.high_slope[side] > 0 ? length * hull.high_slope[side] : 0);
    const float from = low * grid_.inv_cell, until = high * grid_.inv_cell;
    const int a = heading_.side[side];
    const auto end = static_cast<float>(grid_.cells[a]);
    if (!(until >= 0 && from < end)) return false;
    cells.low[a] = from > 0 ? static_cast<int>(from) : 0;
    cells.high[a] = until < end ? static_cast<int>(until) : grid_.cells[a] - 1;
  }
  return true;
}

// How many bricks, beginning with those of these cells, are empty whichever way one goes; 0: one of them is
// not.
template <class Derived, bool kAny>
int Beam<Derived, kAny>::clearance(const CellRange& cells) const {
  int least = 1 << 20;
  for (int x = cells.low[0] >> 2; x <= cells.high[0] >> 2; ++x) {
    for (int y = cells.low[1] >> 2; y <= cells.high[1] >> 2; ++y) {
      for (int z = cells.low[2] >> 2; z <= cells.high[2] >> 2; ++z) {
        const std::int32_t slot = grid_.slot[brick_at(grid_, x, y, z)];
        if (slot >= 0) return 0;
        least = -slot < least ? -slot : least;
      }
    }
  }
  return least;
}

// m aside per metre along the main axis that a bound goes, at most; at least 1.
template <class Derived, bool kAny>
float Beam<Derived, kAny>::steepest(Packets packets) const {
  const Bounds<Floats> b = bounds();
  Floats most = splat(1);
  for (int side = 0; side < 2; ++side) most = max(most, max(abs(b.low_slope[side]), abs(b.high_slope[side])));
  return greatest_lane(select(mask_of_bits(static_cast<int>(packets)), most, splat(1)));
}

template <class Derived, bool kAny>
void Beam<Derived, kAny>::walk(Packets packets, int slab) {
  for (; slab < grid_.cells[heading_.main]; slab += kBrickCells) {
    float near = plane(slab), far = plane(slab + kBrickCells);
    const float end = far;
    packets &= static_cast<Packets>(lane_bits(less_equal(splat(near - reach_), load(furthest_))));
    if (packets == 0) return;
    Packets here = packets & static_cast<Packets>(lane_bits(less_equal(load(from_), splat(far + reach_))));
    if (here == 0) continue;
    const Packets come = here;
    Floats area;
    const Bounds<float> hull = hull_of(here, near, far, area);
    declined_ |= come & ~here;
    packets &= ~(come & ~here);
    CellRange cells;
    if (here == 0 || !cells_of(hull, far, slab, cells)) continue;
    if (const int empty = clearance(cells); empty > 0) {
      // Every brick nearer than `empty` is empty, and the rays go aside by their slope at most.
      slab += kBrickCells * static_cast<int>(static_cast<float>(empty - 1) / steepest(here));
      continue;
    }
    const int count = __builtin_popcount(here);
    const auto across = [&](int side) {
      return static_cast<float>(cells.high[heading_.side[side]] - cells.low[heading_.side[side]] + 1);
    };
    float areas = 0;
    for_each_packet(here, [&](int p) { areas += area[p]; });
    if (count > 1 && across(0) * across(1) * (1 + kTelling * static_cast<float>(count)) > areas) {
      Packets second = packets;
      for (int k = 0; k < __builtin_popcount(packets) / 2; ++k) second &= second - 1;
      walk(packets & ~second, slab);
      walk(second, slab);
      return;
    }
    const Packets declining = self().meet(slab, here, hull, cells);
    declined_ |= declining;
    packets &= ~declining;
    const Packets go_on =
        here & shortened_ & static_cast<Packets>(lane_bits(less_equal(splat(end - reach_), load(furthest_))));
    if (go_on != 0) draw_bounds(go_on, end - reach_);
  }
}

template <class Derived, bool kAny>
void Beam<Derived, kAny>::store_hits(int p) const {
  const Ints none = splat_int(static_cast<std::int32_t>(kNoHit));
  std::int32_t* const hit = hits(p);
  if (kAny) {
    store(hit, select(less_equal(best_[p], splat(kBlocked)), splat_int(0), none));
    return;
  }
  const Mask nothing = equal(particle_[p], none);  // but perhaps a stray
  store(hit, select(nothing, load(hit), particle_[p]));
  float* const t = rays_.t + first_ray(p);
  store(t, select(nothing, load(t), entry_[p] + best_[p]));
}

// Rays [begin, end) by `beam`; what declines, and what is left, by others(from, to): as many as follow one
// another, since they go best together.
template <class TheBeam, class Others>
void trace_in_beams(TheBeam& beam, std::size_t begin, std::size_t end, Others&& others) {
  std::size_t declined = begin;  // from here on
  const auto trace_declined = [&](std::size_t to) {
    if (declined < to) others(declined, to);
  };
  while (begin + kLanes <= end) {
    const std::size_t full = (end - begin) / kLanes;
    const int count = full < kPackets ? static_cast<int>(full) : kPackets;
    const Packets declining = beam.trace(begin, count);
    for (int p = 0; p < count; ++p, begin += kLanes) {
      if ((declining >> p & 1) != 0) continue;
      trace_declined(begin);
      declined = begin + kLanes;
    }
  }
  trace_declined(end);
}

}  // namespace firn::kernels::FIRN_ISA
