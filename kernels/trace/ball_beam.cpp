// SPDX-License-Identifier: MIT
// Coherent rays against balls. Lists by centre do here: each ball is told once a beam, where lists by overlap
// would have it once a cell. Of a slab's balls the planes of the beam's bounds leave few, which are sorted by
// slice; of a slice's balls, nearest slice first, the planes of a packet's bounds leave fewer, and those are
// broadcast against its rays. Rays that are not coherent go by wave.cpp.
#include "kernels/trace/beam.h"

namespace firn::kernels::FIRN_ISA {

void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);   // wave.cpp
void occluded(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // wave.cpp

namespace {

// Balls of a slab within a beam's bounds: where they are, m, and their sorted indices.
struct SeenBalls {
  static constexpr int kMost = 1024;
  float x[3][kMost + kLanes];
  std::int32_t ball[kMost + kLanes];
  int count = 0;

  // Adds those in the mask behind n others; returns how many there are then.
  FIRN_INLINE int add(Mask in, int n, const Heading& heading, Floats along, const Floats aside[2],
                      Ints index) {
    store_packed(x[heading.main] + n, in, along);
    for (int side = 0; side < 2; ++side) store_packed(x[heading.side[side]] + n, in, aside[side]);
    store_packed(ball + n, in, index);
    return n + __builtin_popcount(static_cast<unsigned>(lane_bits(in)));
  }
};

template <bool kAny>
class BallBeam : public Beam<BallBeam<kAny>, kAny> {
  using Base = Beam<BallBeam<kAny>, kAny>;

 public:
  BallBeam(const TraceGrid& grid, const RayView& rays)
      : Base(grid, rays, grid.max_radius + kCellMargin * grid.cell) {}

 private:
  friend Base;
  static constexpr float kCellsPerRay = kAny ? 2.5f : 1.5f;  // measured, docs/decisions/024
  using Base::best_, Base::d_, Base::from_, Base::furthest_, Base::grid_, Base::heading_, Base::kRegisters,
      Base::o_, Base::particle_, Base::reach_;

  Packets meet(int slab, Packets packets, const Bounds<float>& hull, const CellRange& cells);
  FIRN_INLINE Mask within(const Bounds<float>& bounds, Floats along, const Floats aside[2]) const;
  void show(int slab, Packets packets);
  void sort_by_slice(int slab);
  FIRN_INLINE int choose(int p, const SeenBalls& balls, int pairs);
  void test(const SeenBalls& balls, int pairs);

  SeenBalls seen_, slice_[kBrickCells];
  // Of a ball of a slice and a packet: number of the ball times kPackets, and the packet.
  static constexpr int kMostPairs = 256;
  std::int32_t pair_[kMostPairs + kLanes];
  // Of a ball and a register of rays that may meet: number of the ball times kRegisters, and the register.
  std::int32_t met_[kMostPairs * kParts];
  Floats along_[kMostPairs * kParts], depth2_[kMostPairs * kParts];
  int blocked_[kRegisters] = {};  // rays, a bit each
  Packets found_ = 0;             // something in this slice
};

// Whether balls lie between the planes of the bounds.
template <bool kAny>
FIRN_INLINE Mask BallBeam<kAny>::within(const Bounds<float>& b, Floats along, const Floats aside[2]) const {
  const Floats way = heading_.along(along) - b.from;
  Mask in = all_lanes();
  for (int side = 0; side < 2; ++side) {
    in = in & less_equal(fma(way, splat(b.low_slope[side]), splat(b.low[side])), aside[side]) &
         less_equal(aside[side], fma(way, splat(b.high_slope[side]), splat(b.high[side])));
  }
  return in;
}

// Cells of a brick that follow one another are one run, so that registers are full; it is cheaper to tell
// balls than cells.
template <bool kAny>
Packets BallBeam<kAny>::meet(int slab, Packets packets, const Bounds<float>& hull, const CellRange& cells) {
  const float* const column[3] = {grid_.x, grid_.y, grid_.z};
  const float *const u = column[heading_.side[0]], *const v = column[heading_.side[1]],
                     *const w = column[heading_.main];
  int count = 0;
  for_each_register_in(grid_, cells.low, cells.high, [&](std::uint32_t begin, int some) {
    const Floats along = load_some(w + begin, some, 0.f);
    const Floats aside[2] = {load_some(u + begin, some, 0.f), load_some(v + begin, some, 0.f)};
    const Mask in = mask_of_first(some) & within(hull, along, aside);
    count = seen_.add(in, count, heading_, along, aside, lane_numbers() + static_cast<std::int32_t>(begin));
    if (count > SeenBalls::kMost - kLanes) {
      seen_.count = count;
      show(slab, packets);
      count = 0;
    }
  });
  seen_.count = count;
  show(slab, packets);
  return 0;
}

template <bool kAny>
void BallBeam<kAny>::sort_by_slice(int slab) {
  const float first = this->plane(slab);
  int counts[kBrickCells] = {};
  for (int from = 0; from < seen_.count; from += kLanes) {
    const Floats along = load(seen_.x[heading_.main] + from);
    const Floats aside[2] = {load(seen_.x[heading_.side[0]] + from), load(seen_.x[heading_.side[1]] + from)};
    const Mask here = mask_of_first(seen_.count - from < kLanes ? seen_.count - from : kLanes);
    const Floats at = (heading_.along(along) - first) * grid_.inv_cell;
    const Mask before[kBrickCells] = {less(at, splat(1)), less(at, splat(2)), less(at, splat(3)),
                                      all_lanes()};
    for (int k = 0; k < kBrickCells; ++k) {
      const Mask its = here & (k > 0 ? before[k] & !before[k - 1] : before[k]);
      counts[k] = slice_[k].add(its, counts[k], heading_, along, aside, load(seen_.ball + from));
    }
  }
  for (int k = 0; k < kBrickCells; ++k) slice_[k].count = counts[k];
}

// The packets meet what was seen, slice by slice.
template <bool kAny>
void BallBeam<kAny>::show(int slab, Packets packets) {
  sort_by_slice(slab);
  for (int k = 0; k < kBrickCells; ++k) {
    if (slice_[k].count == 0) continue;
    const Mask come = less_equal(splat(this->plane(slab + k) - reach_), load(furthest_));
    const Packets here = packets & static_cast<Packets>(lane_bits(come));
    if (here == 0) continue;
    found_ = 0;
    int pairs = 0;
    for_each_packet(here, [&](int p) { pairs = choose(p, slice_[k], pairs); });
    test(slice_[k], pairs);
    for_each_packet(kAny ? here : 0, [&](int p) {
      for_each_part(p, [&](int i) {
        const Mask blocked = mask_of_bits(blocked_[i]) & this->live(i);
        best_[i] = select(blocked, splat(kBlocked), best_[i]);
        found_ |= static_cast<Packets>(any(blocked)) << p;
        blocked_[i] = 0;
      });
    });
    for_each_packet(found_, [&](int p) { this->shorten(p); });
  }
}

// Pairs of the packet and those balls that are within its bounds, behind `pairs` others; returns how many
// there are then.
template <bool kAny>
FIRN_INLINE int BallBeam<kAny>::choose(int p, const SeenBalls& balls, int pairs) {
  const Bounds<float> bounds = this->bounds_of(p);
  const float *const along = balls.x[heading_.main], *const aside[2] = {balls.x[heading_.side[0]],
                                                                        balls.x[heading_.side[1]]};
  for (int from = 0; from < balls.count; from += kLanes) {
    if (pairs > kMostPairs - kLanes) {
      test(balls, pairs);
      pairs = 0;
    }
    const Floats beside[2] = {load(aside[0] + from), load(aside[1] + from)};
    const Mask in = mask_of_first(balls.count - from < kLanes ? balls.count - from : kLanes) &
                    within(bounds, load(along + from), beside);
    store_packed(pair_ + pairs, in, (lane_numbers() + from) * kPackets + p);
    pairs += __builtin_popcount(static_cast<unsigned>(lane_bits(in)));
  }
  return pairs;
}

// Whether a ball is met is asked first, where it is entered later: so no branch hangs on each.
template <bool kAny>
void BallBeam<kAny>::test(const SeenBalls& balls, int pairs) {
  int met = 0;
  const bool even = grid_.radius == nullptr;
  Floats r = splat(grid_.max_radius), r2 = r * r;
  for (int n = 0; n < pairs; ++n) {
    const unsigned pair = static_cast<unsigned>(pair_[n]), k = pair / kPackets;
    if (!even) {
      r = splat(grid_.radius[balls.ball[k]]);
      r2 = r * abs(r);  // a negative radius is never hit
    }
    for_each_part(static_cast<int>(pair % kPackets), [&](int i) {
      const Floats c[3] = {balls.x[0][k] - o_[0][i], balls.x[1][k] - o_[1][i], balls.x[2][k] - o_[2][i]};
      const Floats d[3] = {d_[0][i], d_[1][i], d_[2][i]};
      Floats along;
      const Floats depth2 = project(c, d, r2, along);
      if (kAny) {
        blocked_[i] |= lane_bits(blocks(depth2, along, best_[i]));
      } else {
        along_[met] = along;
        depth2_[met] = depth2;
        met_[met] = static_cast<std::int32_t>(k * kRegisters) + i;
        met += any(may_enter(depth2, along, r, best_[i]));
      }
    });
  }
  for (int n = 0; n < met; ++n) {
    const unsigned pair = static_cast<unsigned>(met_[n]), i = pair % kRegisters;
    const Ints index = splat_int(balls.ball[pair / kRegisters]);
    const Floats t = along_[n] - sqrt(depth2_[n]);  // NaN where missed: every comparison is then false
    // Flipping the sign bit orders unsigned indices as signed ones.
    const Mask lower = less(index ^ INT32_MIN, particle_[i] ^ INT32_MIN);
    const Mask nearer = less(splat(0), t) & (less(t, best_[i]) | (less_equal(t, best_[i]) & lower));
    best_[i] = select(nearer, t, best_[i]);
    particle_[i] = select(nearer, index, particle_[i]);
    found_ |= static_cast<Packets>(any(nearer)) << i / kParts;
  }
}

template <bool kAny>
void trace_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  BallBeam<kAny> beam(grid, rays);
  trace_in_beams(beam, begin, end, [&](std::size_t from, std::size_t to) {
    (kAny ? occluded : closest)(grid, rays, from, to);
  });
}

}  // namespace

void closest_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_coherent<false>(grid, rays, begin, end);
}
void occluded_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_coherent<true>(grid, rays, begin, end);
}

}  // namespace firn::kernels::FIRN_ISA
