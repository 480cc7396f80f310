// SPDX-License-Identifier: MIT
// Coherent rays: sixteen are a packet, and there are as many packets as a register has lanes. Each packet has
// bounds within which its rays go, planes beside the axis that all go along most.
//
//              o----___              Rays between two planes across that axis lie between the lines from the
//              |  o-----~~~~---  |   outermost of them here to the outermost there. Bounds are drawn anew
//              o-----------------    when some rays were shortened.
//
// beam.h walks through the grid with them.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr int kPacketRays = 16,
                     kParts = kPacketRays / kLanes;  // rays of a packet, and registers of them
inline constexpr int kPackets = kLanes;              // of a beam, at most
inline constexpr float kMinMainShare = 0.4f;         // of every direction along the main axis
inline constexpr float kFar = 3e38f;
inline constexpr float kBlocked = -2;  // m, of rays that something blocks: a reach of less than nothing

using Packets = std::uint32_t;  // a set of them, a bit each

template <class Body>
FIRN_INLINE void for_each_packet(Packets packets, Body&& body) {
  for (; packets != 0; packets &= packets - 1) body(__builtin_ctz(packets));
}

// Calls body(i) for the registers of a packet's rays, as they are counted in a beam.
template <class Body>
FIRN_INLINE void for_each_part(int p, Body&& body) {
#pragma GCC unroll 4
  for (int i = p * kParts; i < (p + 1) * kParts; ++i) body(i);
}

template <class Body>
FIRN_INLINE void for_each_ray_register(Packets packets, Body&& body) {
  for_each_packet(packets, [&](int p) { for_each_part(p, body); });
}

// Which way a beam goes: along the main axis, counted up in its direction.
struct Heading {
  int main, side[2];  // axes
  bool forward;

  FIRN_INLINE Floats along(Floats x) const { return forward ? x : -x; }
};

// Bounds beside the main axis: at the plane `from` across it, and per metre along it. T: a float, or a lane
// for each packet of a beam.
template <class T>
struct Bounds {
  T from;             // m
  T low[2], high[2];  // m, of each axis beside the main one
  T low_slope[2], high_slope[2];
};

// kAny: whether any hit will do.
template <bool kAny>
class RayPackets {
 protected:
  // reach: m, from what is met to its place in the grid.
  RayPackets(const TraceGrid& grid, const RayView& rays, float reach)
      : grid_(grid), rays_(rays), reach_(reach) {}

  FIRN_INLINE Mask live(int i) const { return less_equal(splat(0), best_[i]); }
  // The coordinate along the main axis at the k-th cell that the rays come to.
  FIRN_INLINE float plane(int k) const {
    return static_cast<float>(heading_.forward ? k : k - grid_.cells[heading_.main]) * grid_.cell;
  }
  // How far a packet reaches, once rays of it have found something.
  FIRN_INLINE void shorten(int p) {
    Floats furthest = splat(-kFar);
    for_each_part(p, [&](int i) {
      furthest = max(furthest, select(live(i), fma(best_[i], speed_[i], start_[i]), splat(-kFar)));
    });
    furthest_[p] = greatest_lane(furthest);
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
  // Takes a register of rays, strays first; then each ray is moved to the grid.
  FIRN_INLINE void load_rays(int i);
  // Chooses the axis that the first of these packets goes along most, draws bounds for those that go along it
  // the same way and returns them. Declines those whose rays do not all do so.
  Packets heading_along(Packets packets);
  // Of the rays of these packets that reach beyond `from` along the main axis.
  void draw_bounds(Packets packets, float from);
  void store_hits(int i) const;

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t begin_ = 0;
  float reach_;  // m
  Heading heading_;
  // Registers of rays, those of a packet together.
  static constexpr int kRegisters = kPackets * kParts;
  Floats o_[3][kRegisters], d_[3][kRegisters];  // m; origins moved to the grid's edge
  Floats entry_[kRegisters];                    // m, from the ray's origin to the moved one
  Floats best_[kRegisters];                     // m from the moved origin; negative: not in the grid
  Ints particle_[kRegisters];  // the bits of a sorted index, kSurfaceHit or kNoHit; not of any hits
  // Of each packet, along the main axis: where its bounds begin and how far its rays reach.
  float from_[kLanes] = {}, furthest_[kLanes] = {};
  Packets shortened_ = 0;  // since their bounds were drawn
  Packets declined_ = 0;   // their rays go by other ways

 private:
  std::size_t first_ray(int i) const { return begin_ + static_cast<std::size_t>(i) * kLanes; }
  std::int32_t* hits(int i) const { return reinterpret_cast<std::int32_t*>(rays_.hit + first_ray(i)); }

  // The coordinate along the main axis, which counts up in the rays' direction: where rays begin, its growth
  // a metre of the ray, and how far they go aside a metre of it.
  Floats start_[kRegisters], speed_[kRegisters], tilt_[2][kRegisters];
  float low_[2][kLanes] = {}, high_[2][kLanes] = {}, low_slope_[2][kLanes] = {}, high_slope_[2][kLanes] = {};
};

template <bool kAny>
FIRN_INLINE void RayPackets<kAny>::load_rays(int i) {
  const std::size_t from = first_ray(i);
  const Ints none = splat_int(static_cast<std::int32_t>(kNoHit));
  store(hits(i), none);
  for (std::size_t k = from; k < from + kLanes && grid_.stray_bundles > 0; ++k) {
    Nearest stray{rays_.t[k], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, k), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[k] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[k] = stray.t;
  }
  constexpr int kNext = kPackets * kPacketRays;
  Floats o[3], d[3], moved[3];
  for (int a = 0; a < 3; ++a) {
    o[a] = load(rays_.origin[a] + from);
    d_[a][i] = d[a] = load(rays_.direction[a] + from);
    __builtin_prefetch(rays_.origin[a] + from + kNext);
    __builtin_prefetch(rays_.direction[a] + from + kNext);
  }
  __builtin_prefetch(rays_.t + from + kNext);
  entry_[i] = enter_grid(grid_, o, d, load(rays_.t + from), moved, best_[i]);
  for (int a = 0; a < 3; ++a) o_[a][i] = moved[a];
  particle_[i] = none;
  if (kAny) best_[i] = select(equal(load(hits(i)), none), best_[i], splat(kBlocked));
}

template <bool kAny>
Packets RayPackets<kAny>::heading_along(Packets packets) {
  const auto main_of = [&](int p, bool& forward) {
    int i = p * kParts;
    while (!any(live(i))) ++i;
    const int first = __builtin_ctz(static_cast<unsigned>(lane_bits(live(i))));
    const auto size = [&](int a) { return __builtin_fabsf(d_[a][i][first]); };
    const int main = size(0) > size(1) ? (size(0) > size(2) ? 0 : 2) : (size(1) > size(2) ? 1 : 2);
    forward = d_[main][i][first] > 0;
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
    for_each_part(p, [&](int i) {
      start_[i] = heading_.along(o_[heading_.main][i]);
      speed_[i] = heading_.along(d_[heading_.main][i]);
      declined_ |= static_cast<Packets>(any(live(i) & !less(splat(kMinMainShare), speed_[i]))) << p;
      const Floats per_metre = splat(1) / speed_[i];
      for (int side = 0; side < 2; ++side) tilt_[side][i] = d_[heading_.side[side]][i] * per_metre;
    });
  });
  draw_bounds(same & ~declined_, -kFar);
  return same;
}

template <bool kAny>
FIRN_INLINE Bounds<Floats> RayPackets<kAny>::bounds() const {
  return {load(from_),
          {load(low_[0]), load(low_[1])},
          {load(high_[0]), load(high_[1])},
          {load(low_slope_[0]), load(low_slope_[1])},
          {load(high_slope_[0]), load(high_slope_[1])}};
}

// Around the rays of these packets that reach beyond `from` along the main axis. A bound on the way from one
// plane to another is linear, since every ray is.
template <bool kAny>
void RayPackets<kAny>::draw_bounds(Packets packets, float from) {
  const float edge = heading_.forward ? grid_.cell * static_cast<float>(grid_.cells[heading_.main]) : 0;
  Mask ahead[kRegisters];
  Floats nearest[kPackets], furthest[kPackets];
  for_each_packet(packets, [&](int p) {
    nearest[p] = furthest[p] = splat(-kFar);
    for_each_part(p, [&](int i) {
      const Floats end = fma(best_[i], speed_[i], start_[i]);
      ahead[i] = live(i) & less_equal(splat(from), end);
      nearest[p] = max(nearest[p], select(ahead[i], -start_[i], splat(-kFar)));
      furthest[p] = max(furthest[p], select(ahead[i], end, splat(-kFar)));
    });
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
        low[end][p] = high[end][p] = splat(-kFar);
        for_each_part(p, [&](int i) {
          const Floats way = splat(end == 0 ? from_[p] : to_of[p]) - start_[i];
          const Floats at = fma(way, tilt_[side][i], o_[heading_.side[side]][i]);
          low[end][p] = max(low[end][p], select(ahead[i], -at, splat(-kFar)));
          high[end][p] = max(high[end][p], select(ahead[i], at, splat(-kFar)));
        });
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

template <bool kAny>
void RayPackets<kAny>::store_hits(int i) const {
  const Ints none = splat_int(static_cast<std::int32_t>(kNoHit));
  std::int32_t* const hit = hits(i);
  if (kAny) {
    store(hit, select(less_equal(best_[i], splat(kBlocked)), splat_int(0), none));
    return;
  }
  const Mask nothing = equal(particle_[i], none);  // but perhaps a stray
  store(hit, select(nothing, load(hit), particle_[i]));
  float* const t = rays_.t + first_ray(i);
  store(t, select(nothing, load(t), entry_[i] + best_[i]));
}

}  // namespace firn::kernels::FIRN_ISA
