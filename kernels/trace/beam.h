// SPDX-License-Identifier: MIT
// Coherent rays that go through the grid together (after Wald et al. 2006, "Ray tracing animated scenes using
// coherent grid traversal"): sixteen rays are a packet, and as many packets as a register has lanes are a
// beam. It walks along the axis that its rays go along most, a slab of bricks at a time. The common bounds
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
#include "kernels/trace/cell_list.h"
#include "kernels/trace/packet.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr float kTelling = 1.f / 32;  // a packet's time to tell what a cell holds, of looking into it

// Cells, both ends are in it.
struct CellRange {
  int low[3], high[3];
};

// Derived has
// * kCellsPerRay, as TraceGrid's cells_per_ray, beyond which a packet declines
// * where it needs one, void set_aside(int i): takes rays of a register out that begin where the beam cannot
//   follow them
// * Packets meet(int slab, Packets, const Bounds<float>& hull, const CellRange&): tests what the cells hold,
//   which are of the four slices from `slab` on, against these packets and has them shorten(p) when something
//   was found; returns those that decline
template <class Derived, bool kAny>
class Beam : public RayPackets<kAny> {
 public:
  // `count` packets of the rays from `begin` on. Returns those that are not coherent, or are or grow too wide
  // (TraceGrid), or decline: nothing is found for their rays (a stray that shortened a ray is found again,
  // within its reach).
  Packets trace(std::size_t begin, int count);

 protected:
  using Base = RayPackets<kAny>;
  using Base::begin_, Base::declined_, Base::from_, Base::furthest_, Base::grid_, Base::heading_, Base::live,
      Base::plane, Base::reach_, Base::shortened_;

  Beam(const TraceGrid& grid, const RayView& rays, float reach) : Base(grid, rays, reach) {}

  void set_aside(int) {}

 private:
  Derived& self() { return *static_cast<Derived*>(this); }
  void walk(Packets packets, int slab);
  Bounds<float> hull_of(Packets& packets, float& near, float& far, Floats& area) const;
  bool cells_of(const Bounds<float>& hull, float to, int slab, CellRange& cells) const;
  int clearance(const CellRange& cells) const;
  float steepest(Packets packets) const;
};

template <class Derived, bool kAny>
Packets Beam<Derived, kAny>::trace(std::size_t begin, int count) {
  begin_ = begin;
  Packets going = 0;
  declined_ = 0;
  for (int p = 0; p < count; ++p) {
    for_each_part(p, [&](int i) {
      this->load_rays(i);
      self().set_aside(i);
      going |= static_cast<Packets>(any(live(i))) << p;
    });
  }
  while (going != 0) {
    const Packets same = this->heading_along(going);
    going &= ~same;
    const Packets packets = same & ~declined_;
    if (packets == 0) continue;
    float least = kFar;
    for_each_packet(packets, [&](int p) { least = from_[p] < least ? from_[p] : least; });
    const float first = least - reach_ - plane(0);
    walk(packets, first > 0 ? static_cast<int>(first * grid_.inv_cell) & ~3 : 0);
  }
  for (int p = 0; p < count; ++p) {
    if ((declined_ >> p & 1) == 0) for_each_part(p, [&](int i) { this->store_hits(i); });
  }
  return declined_;
}

// Around these packets from the plane `near` to the plane `far`, which are moved to where there are any;
// those that are too wide are taken out. area: the cells across that each of them alone would look into.
template <class Derived, bool kAny>
Bounds<float> Beam<Derived, kAny>::hull_of(Packets& packets, float& near, float& far, Floats& area) const {
  const Bounds<Floats> b = this->bounds();
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
  here = here & less_equal(section, splat(most * kPacketRays));
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
  const Bounds<Floats> b = this->bounds();
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
    if (go_on != 0) this->draw_bounds(go_on, end - reach_);
  }
}

// Rays [begin, end) by `beam`; what declines, and what is left, by others(from, to): as many as follow one
// another, since they go best together.
template <class TheBeam, class Others>
void trace_in_beams(TheBeam& beam, std::size_t begin, std::size_t end, Others&& others) {
  std::size_t declined = begin;  // from here on
  const auto trace_declined = [&](std::size_t to) {
    if (declined < to) others(declined, to);
  };
  while (begin + kPacketRays <= end) {
    const std::size_t full = (end - begin) / kPacketRays;
    const int count = full < kPackets ? static_cast<int>(full) : kPackets;
    const Packets declining = beam.trace(begin, count);
    for (int p = 0; p < count; ++p, begin += kPacketRays) {
      if ((declining >> p & 1) != 0) continue;
      trace_declined(begin);
      declined = begin + kPacketRays;
    }
  }
  trace_declined(end);
}

}  // namespace firn::kernels::FIRN_ISA
