// SPDX-License-Identifier: MIT
// Packets of rays against balls. Lists by centre do here: each ball is tested once a packet, where lists by
// overlap would test it once a cell. Of a slab's balls the planes of the packet's bounds leave few, which are
// sorted by slice and broadcast against the rays, nearest slice first. Rays that are not coherent go by
// wave.cpp.
#include "kernels/trace/packet.h"

namespace firn::kernels::FIRN_ISA {

void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);   // wave.cpp
void occluded(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // wave.cpp

namespace {

template <bool kAny>
class BallPacket : public Packet<BallPacket<kAny>, kAny> {
  using Base = Packet<BallPacket<kAny>, kAny>;

 public:
  BallPacket(const TraceGrid& grid, const RayView& rays, std::size_t begin)
      : Base(grid, rays, begin, grid.max_radius + kCellMargin * grid.cell) {}

 private:
  friend Base;
  static constexpr float kWidest = kAny ? 8 : 5;  // where the sun grazes, rays to it begin far apart
  using Base::at_, Base::best_, Base::d_, Base::forward_, Base::found_, Base::from_, Base::furthest_,
      Base::grid_, Base::kParts, Base::main_, Base::o_, Base::particle_, Base::reach_, Base::side_,
      Base::slope_;

  Slab meet(int slab, const CellRange& cells);
  void bounds_drawn();
  void collect(const CellRange& cells);
  FIRN_INLINE void collect_run(std::uint32_t begin, std::uint32_t end);
  FIRN_INLINE Mask in_bounds(std::uint32_t begin, int some, Floats along) const;
  void sort_by_slice(float plane);
  FIRN_INLINE void test_ball(std::uint32_t ball);
  FIRN_INLINE Floats seen(int part, Floats x, Floats y, Floats z, Floats r2, Floats& along) const;
  void settle();

  // A ball that rays of a part may enter.
  struct Meeting {
    Floats along, depth2;  // m, m^2
    std::int32_t ball;
    int part;
  };
  static constexpr int kMostMeetings = 64;
  static constexpr int kMostCollected = 512;

  Meeting meeting_[kAny ? 1 : kMostMeetings];
  int meetings_ = 0;
  // Balls of a slab within the bounds, and how far along from from_ they are (m); then sorted by slice.
  std::int32_t ball_[kMostCollected + kLanes];
  float along_[kMostCollected + kLanes];
  int collected_ = 0;
  std::int32_t sorted_[kBrickCells][kMostCollected + kLanes];
  int in_slice_[kBrickCells];
  Window near_;  // at_, widened by what a ball reaches across the bound
};

template <bool kAny>
FIRN_INLINE void BallPacket<kAny>::test_ball(std::uint32_t b) {
  const Floats x = splat(grid_.x[b]), y = splat(grid_.y[b]), z = splat(grid_.z[b]);
  const float r = grid_.radius == nullptr ? grid_.max_radius : grid_.radius[b];
  const Floats r2 = splat(r * __builtin_fabsf(r));  // a negative radius is never hit
  if (kAny) {
    Mask some = mask_of_bits(0);
#pragma GCC unroll 16
    for (int part = 0; part < kParts; ++part) {
      Floats along;
      const Floats depth2 = seen(part, x, y, z, r2, along);
      const Mask blocked = blocks(depth2, along, best_[part]);
      best_[part] = select(blocked, splat(kBlocked), best_[part]);
      some = some | blocked;
    }
    found_ |= any(some);
    return;
  }
#pragma GCC unroll 16
  for (int part = 0; part < kParts; ++part) {
    Meeting& m = meeting_[meetings_];
    m.depth2 = seen(part, x, y, z, r2, m.along);
    m.ball = static_cast<std::int32_t>(b);
    m.part = part;
    meetings_ += any(may_enter(m.depth2, m.along, splat(r), best_[part]));
  }
  if (meetings_ > kMostMeetings - kParts) settle();
}

template <bool kAny>
FIRN_INLINE Floats BallPacket<kAny>::seen(int part, Floats x, Floats y, Floats z, Floats r2,
                                          Floats& along) const {
  const Floats c[3] = {x - o_[0][part], y - o_[1][part], z - o_[2][part]};
  const Floats d[3] = {d_[0][part], d_[1][part], d_[2][part]};
  return project(c, d, r2, along);
}

// Whether a ball is met is asked first, where it is entered later: so no branch hangs on each.
template <bool kAny>
void BallPacket<kAny>::settle() {
  for (int k = 0; k < meetings_; ++k) {
    const Meeting& m = meeting_[k];
    Floats& best = best_[m.part];
    Ints& particle = particle_[m.part];
    const Ints index = splat_int(m.ball);
    const Floats t = m.along - sqrt(m.depth2);  // NaN where missed: every comparison is then false
    // Flipping the sign bit orders unsigned indices as signed ones.
    const Mask lower = less(index ^ INT32_MIN, particle ^ INT32_MIN);
    const Mask nearer = less(splat(0), t) & (less(t, best) | (less_equal(t, best) & lower));
    best = select(nearer, t, best);
    particle = select(nearer, index, particle);
    found_ |= any(nearer);
  }
  meetings_ = 0;
}

template <bool kAny>
void BallPacket<kAny>::bounds_drawn() {
  for (int side = 0; side < 2; ++side) {
    const auto across = [&](float slope) { return reach_ * __builtin_sqrtf(1 + slope * slope); };
    near_.low[side] = at_.low[side] - across(slope_.low[side]);
    near_.high[side] = at_.high[side] + across(slope_.high[side]);
  }
}

// Of a register of balls, so far along from from_, those that the bounds' planes leave to the rays.
template <bool kAny>
FIRN_INLINE Mask BallPacket<kAny>::in_bounds(std::uint32_t begin, int some, Floats along) const {
  const float* const column[3] = {grid_.x, grid_.y, grid_.z};
  Mask in = mask_of_first(some) & less_equal(splat(-reach_), along) &
            less_equal(along, splat(furthest_ + reach_ - from_));
  for (int side = 0; side < 2; ++side) {
    const Floats c = load_first(column[side_[side]] + begin, some, 0.f);
    in = in & less_equal(fma(along, splat(slope_.low[side]), splat(near_.low[side])), c) &
         less_equal(c, fma(along, splat(slope_.high[side]), splat(near_.high[side])));
  }
  return in;
}

template <bool kAny>
FIRN_INLINE void BallPacket<kAny>::collect_run(std::uint32_t begin, std::uint32_t end) {
  const float* const column[3] = {grid_.x, grid_.y, grid_.z};
  for (; begin < end; begin += kLanes) {
    const int some = end - begin < kLanes ? static_cast<int>(end - begin) : kLanes;
    const Floats at = load_first(column[main_] + begin, some, 0.f);
    const Floats along = (forward_ ? at : -at) - from_;
    const Mask in = in_bounds(begin, some, along);
    store_packed(ball_ + collected_, in, lane_numbers() + static_cast<std::int32_t>(begin));
    store_packed(along_ + collected_, in, along);
    collected_ += __builtin_popcount(static_cast<unsigned>(lane_bits(in)));
    if (collected_ >= kMostCollected) {
      for (int k = 0; k < collected_; ++k) test_ball(static_cast<std::uint32_t>(ball_[k]));
      collected_ = 0;
    }
  }
}

// The balls of these cells, which lie in one slab, that are within the bounds. Cells of a brick that follow
// one another are one run, so that registers are full; it is cheaper to tell balls than cells.
template <bool kAny>
void BallPacket<kAny>::collect(const CellRange& cells) {
  for_each_long_run(grid_, cells.low, cells.high,
                    [&](std::uint32_t begin, std::uint32_t end) { collect_run(begin, end); });
}

// Balls that were collected, by slice of the slab that begins at `plane`.
template <bool kAny>
void BallPacket<kAny>::sort_by_slice(float plane) {
  for (int& in_slice : in_slice_) in_slice = 0;
  for (int from = 0; from < collected_; from += kLanes) {
    const Mask here = mask_of_first(collected_ - from < kLanes ? collected_ - from : kLanes);
    const Floats slice = (load(along_ + from) + (from_ - plane)) * grid_.inv_cell;
    const Mask before[kBrickCells] = {less(slice, splat(1)), less(slice, splat(2)), less(slice, splat(3)),
                                      all_lanes()};
    for (int k = 0; k < kBrickCells; ++k) {
      const Mask its = here & (k > 0 ? before[k] & !before[k - 1] : before[k]);
      store_packed(sorted_[k] + in_slice_[k], its, load(ball_ + from));
      in_slice_[k] += __builtin_popcount(static_cast<unsigned>(lane_bits(its)));
    }
  }
  collected_ = 0;
}

template <bool kAny>
Slab BallPacket<kAny>::meet(int slab, const CellRange& cells) {
  for (int k = slab; k < slab + kBrickCells; k += kBrickCells - 1) {
    if (this->wide(this->window(k, 1))) return Slab::declined;
  }
  collect(cells);
  sort_by_slice(this->plane(slab));
  for (int k = 0; k < kBrickCells; ++k) {
    for (int i = 0; i < in_slice_[k]; ++i) test_ball(static_cast<std::uint32_t>(sorted_[k][i]));
    settle();
    this->shorten();
    if (this->plane(slab + k + 1) - reach_ > furthest_) return Slab::ended;
  }
  return Slab::passed;
}

template <bool kAny>
void trace_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_in_packets(
      begin, end, [&](std::size_t from) { return BallPacket<kAny>(grid, rays, from).trace(); },
      [&](std::size_t from, std::size_t to) { (kAny ? occluded : closest)(grid, rays, from, to); });
}

}  // namespace

void closest_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_coherent<false>(grid, rays, begin, end);
}
void occluded_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_coherent<true>(grid, rays, begin, end);
}

}  // namespace firn::kernels::FIRN_ISA
