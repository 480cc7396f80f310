// SPDX-License-Identifier: MIT
// Coherent rays, 64 or 16 at a time (Wald et al. 2006, "Ray tracing animated scenes using coherent grid
// traversal"): the packet goes through the grid along its main axis, a slab of bricks at a time. The rays'
// common bounds, widened by the largest radius, name the cells whose balls can be met; of these the bounds'
// planes leave few, which are sorted by slice and broadcast against the rays, nearest slice first.
//
//     slab of bricks   rays     o---->---------      Lists by centre do here: each ball is tested once a
//     packet,
//     +---+---+---+        o---->---------           where lists by overlap would test it once a cell.
//     |   |###|###|  <- cells within the bounds
//
// A packet whose bounds are wide against the cells is split, and rays that are not coherent go by wave.cpp.
#include "kernels/trace/packet.h"
#include "kernels/trace/cell_list.h"

namespace firn::kernels::FIRN_ISA {

void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);   // wave.cpp
void occluded(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // wave.cpp

template <int kRays, bool kAny>
bool Packet<kRays, kAny>::choose_main() {
  int part = 0;
  while (!any(live(part))) ++part;
  const int first = __builtin_ctz(static_cast<unsigned>(lane_bits(live(part))));
  const auto size = [&](int a) { return __builtin_fabsf(d_[a][part][first]); };
  main_ = size(0) > size(1) ? (size(0) > size(2) ? 0 : 2) : (size(1) > size(2) ? 1 : 2);
  side_[0] = main_ == 0 ? 1 : 0;
  side_[1] = main_ == 2 ? 1 : 2;
  forward_ = d_[main_][part][first] > 0;
  for (part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? d_[main_][part] : -d_[main_][part];
    if (any(live(part) & !less(splat(kMinMainShare), along))) return false;
  }
  look_ahead(-kFar);
  return true;
}

// The bounds of the rays that reach beyond `from` along the main axis.
template <int kRays, bool kAny>
void Packet<kRays, kAny>::look_ahead(float from) {
  Floats nearest = splat(kFar), furthest = splat(-kFar);
  Mask ahead[kParts];
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    const Floats end = fma(best_[part], speed, along);
    ahead[part] = live(part) & less_equal(splat(from), end);
    nearest = min(nearest, select(ahead[part], along, splat(kFar)));
    furthest = max(furthest, select(ahead[part], end, splat(-kFar)));
  }
  furthest_ = greatest_lane(furthest);
  const float least = -greatest_lane(-nearest),
              edge = forward_ ? grid_.cell * static_cast<float>(grid_.cells[main_]) : 0;
  from_ = least > from ? least : from;
  to_ = furthest_ < edge ? furthest_ : edge;
  to_ = to_ > from_ + grid_.cell ? to_ : from_ + grid_.cell;
  for (int side = 0; side < 2; ++side) {
    Floats low[2] = {splat(kFar), splat(kFar)}, high[2] = {splat(-kFar), splat(-kFar)};
    for (int part = 0; part < kParts; ++part) {
      const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
      const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
      const Floats slope = d_[side_[side]][part] / speed;
      for (int plane = 0; plane < 2; ++plane) {
        const Floats at = fma(splat(plane == 0 ? from_ : to_) - along, slope, o_[side_[side]][part]);
        low[plane] = min(low[plane], select(ahead[part], at, splat(kFar)));
        high[plane] = max(high[plane], select(ahead[part], at, splat(-kFar)));
      }
    }
    at_.low[side] = -greatest_lane(-low[0]);
    at_.high[side] = greatest_lane(high[0]);
    const float length = to_ - from_;
    slope_.low[side] = (-greatest_lane(-low[1]) - at_.low[side]) / length;
    slope_.high[side] = (greatest_lane(high[1]) - at_.high[side]) / length;
    const auto across = [&](float slope) { return reach_ * __builtin_sqrtf(1 + slope * slope); };
    near_.low[side] = at_.low[side] - across(slope_.low[side]);
    near_.high[side] = at_.high[side] + across(slope_.high[side]);
  }
}

// How far the rays reach, once some have found something.
template <int kRays, bool kAny>
FIRN_INLINE void Packet<kRays, kAny>::shorten() {
  Floats furthest = splat(-kFar);
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    furthest = max(furthest, select(live(part), fma(best_[part], speed, along), splat(-kFar)));
  }
  furthest_ = greatest_lane(furthest);
}

// Where the rays can be between two planes of the main axis, near <= far, widened by the reach. A bound on
// the way from one plane to another is linear, since every ray is.
template <int kRays, bool kAny>
FIRN_INLINE Window Packet<kRays, kAny>::window(float near, float far) const {
  const float length = to_ - from_;
  const auto inside = [&](float along) { return along < 0 ? 0 : along > length ? length : along; };
  const float first = inside(near - from_), last = inside(far - from_);
  Window w;
  for (int side = 0; side < 2; ++side) {
    const float low = slope_.low[side] < 0 ? last : first, high = slope_.high[side] < 0 ? first : last;
    w.low[side] = at_.low[side] + low * slope_.low[side] - reach_;
    w.high[side] = at_.high[side] + high * slope_.high[side] + reach_;
  }
  return w;
}

// The cells of slices first to last (counted up the axis) within the window; false if there are none.
template <int kRays, bool kAny>
FIRN_INLINE bool Packet<kRays, kAny>::cells_of(const Window& w, int first, int last, int low[3],
                                               int high[3]) const {
  low[main_] = first;
  high[main_] = last;
  for (int side = 0; side < 2; ++side) {
    const int a = side_[side];
    const float from = w.low[side] * grid_.inv_cell, to = w.high[side] * grid_.inv_cell;
    const auto cells = static_cast<float>(grid_.cells[a]);
    if (!(to >= 0 && from < cells)) return false;
    low[a] = from > 0 ? static_cast<int>(from) : 0;
    high[a] = to < cells ? static_cast<int>(to) : grid_.cells[a] - 1;
  }
  return true;
}

// How many bricks, beginning with those of these cells, are empty whichever way one goes; 0: one of them is
// not.
template <int kRays, bool kAny>
int Packet<kRays, kAny>::clearance(const int low[3], const int high[3]) const {
  int least = 1 << 20;
  for (int x = low[0] >> 2; x <= high[0] >> 2; ++x) {
    for (int y = low[1] >> 2; y <= high[1] >> 2; ++y) {
      for (int z = low[2] >> 2; z <= high[2] >> 2; ++z) {
        const std::int32_t slot = grid_.slot[brick_at(grid_, x, y, z)];
        if (slot >= 0) return 0;
        least = -slot < least ? -slot : least;
      }
    }
  }
  return least;
}

// Of a register of balls, so far along from from_, those that the bounds' planes leave to the rays.
template <int kRays, bool kAny>
FIRN_INLINE Mask Packet<kRays, kAny>::in_bounds(std::uint32_t begin, int some, Floats along) const {
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

template <int kRays, bool kAny>
FIRN_INLINE void Packet<kRays, kAny>::collect_run(std::uint32_t begin, std::uint32_t end, float plane) {
  const float* const column[3] = {grid_.x, grid_.y, grid_.z};
  for (; begin < end; begin += kLanes) {
    const int some = end - begin < kLanes ? static_cast<int>(end - begin) : kLanes;
    const Floats at = load_first(column[main_] + begin, some, 0.f);
    const Floats along = (forward_ ? at : -at) - from_;
    const Mask in = in_bounds(begin, some, along);
    const Floats slices = min(max((along + (from_ - plane)) * grid_.inv_cell, splat(0)), splat(3));
    store_packed(ball_ + collected_, in, lane_numbers() + static_cast<std::int32_t>(begin));
    store_packed(slice_ + collected_, in, __builtin_convertvector(slices, Ints));
    collected_ += __builtin_popcount(static_cast<unsigned>(lane_bits(in)));
    if (collected_ > kMostCollected - kLanes) {
      for (int k = 0; k < collected_; ++k) test_ball(static_cast<std::uint32_t>(ball_[k]));
      collected_ = 0;
    }
  }
}

// The balls of these cells, which lie in one slab, that are within the bounds. Cells of a brick that follow
// one another along y and z are one run, so that registers are full; it is cheaper to tell balls than cells.
template <int kRays, bool kAny>
void Packet<kRays, kAny>::collect(const int low[3], const int high[3], float plane) {
  for_each_long_run(grid_, low, high,
                    [&](std::uint32_t begin, std::uint32_t end) { collect_run(begin, end, plane); });
}

// Those that were collected, slice by slice; true if no ray goes further.
template <int kRays, bool kAny>
bool Packet<kRays, kAny>::test_slab(float plane) {
  int next[kBrickCells] = {}, end[kBrickCells];
  std::int32_t sorted[kMostCollected];
  for (int k = 0; k < collected_; ++k) ++next[slice_[k]];
  for (int k = 0, sum = 0; k < kBrickCells; ++k) {
    end[k] = sum + next[k];
    next[k] = sum;
    sum = end[k];
  }
  for (int k = 0; k < collected_; ++k) sorted[next[slice_[k]]++] = ball_[k];
  bool done = false;
  for (int k = 0, ball = 0; k < kBrickCells && !done; ++k) {
    const bool before = found_;
    found_ = false;
    for (; ball < end[k]; ++ball) test_ball(static_cast<std::uint32_t>(sorted[ball]));
    settle();
    if (found_) shorten();
    found_ |= before;
    done = plane + static_cast<float>(k + 1) * grid_.cell - reach_ > furthest_;
  }
  collected_ = 0;
  return done;
}

// Slab of bricks after slab of bricks, slice after slice. "Along" counts in the rays' direction.
template <int kRays, bool kAny>
bool Packet<kRays, kAny>::walk(float widest) {
  const float most = widest * grid_.cell + 2 * reach_;
  const int cells = grid_.cells[main_];
  const auto plane = [&](int k) { return static_cast<float>(forward_ ? k : k - cells) * grid_.cell; };
  const float begin = from_ - reach_ - plane(0);
  const int first = begin > 0 ? static_cast<int>(begin * grid_.inv_cell) : 0;
  float steepest = 1;
  for (int side = 0; side < 2; ++side) {
    const float low = __builtin_fabsf(slope_.low[side]), high = __builtin_fabsf(slope_.high[side]);
    steepest = low > steepest ? low : steepest;
    steepest = high > steepest ? high : steepest;
  }
  for (int slab = first & ~3; slab < cells; slab += kBrickCells) {
    if (plane(slab) - reach_ > furthest_) return true;
    int low[3], high[3];
    const auto slices = [&](int k, int count, int& first_cell, int& last_cell) {
      first_cell = forward_ ? k : cells - k - count;
      last_cell = first_cell + count - 1;
    };
    int least, last;
    slices(slab, kBrickCells, least, last);
    if (!cells_of(window(plane(slab) - reach_, plane(slab + kBrickCells) + reach_), least, last, low, high))
      continue;
    if (const int empty = clearance(low, high); empty > 0) {
      // Every brick nearer than `empty` is empty, and the rays go aside by their slope at most.
      slab += kBrickCells * static_cast<int>(static_cast<float>(empty - 1) / steepest);
      continue;
    }
    for (int k = slab; k < slab + kBrickCells; k += kBrickCells - 1) {
      const Window here = window(plane(k) - reach_, plane(k + 1) + reach_);
      if (here.high[0] - here.low[0] > most || here.high[1] - here.low[1] > most) return false;
    }
    found_ = false;
    collect(low, high, plane(slab));
    if (test_slab(plane(slab))) return true;
    if (found_) look_ahead(plane(slab + kBrickCells) - reach_);
  }
  return true;
}

namespace {

constexpr int kLarge = 64, kSmall = 16;  // rays

// False if the packet is too wide or not coherent; nothing is found then (a stray that shortened a ray is
// found again: it lies within the reach).
template <int kRays, bool kAny>
bool trace_packet(const TraceGrid& grid, const RayView& rays, std::size_t begin, float widest) {
  Packet<kRays, kAny> packet(grid, rays, begin);
  if (!packet.load_rays()) return true;
  if (!packet.choose_main() || !packet.walk(widest)) return false;
  packet.store_hits();
  return true;
}

// Cells across a packet beyond which fewer rays at a time are faster; from the bench.
constexpr float kWidestLarge = 16, kWidestSmall = 8;

template <bool kAny>
void trace_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  const auto one_by_one = kAny ? occluded : closest;
  for (; begin + kLarge <= end; begin += kLarge) {
    if (trace_packet<kLarge, kAny>(grid, rays, begin, kWidestLarge)) continue;
    for (std::size_t part = begin; part < begin + kLarge; part += kSmall) {
      if (!trace_packet<kSmall, kAny>(grid, rays, part, kWidestSmall))
        one_by_one(grid, rays, part, part + kSmall);
    }
  }
  one_by_one(grid, rays, begin, end);
}

}  // namespace

void closest_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_coherent<false>(grid, rays, begin, end);
}
void occluded_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  trace_coherent<true>(grid, rays, begin, end);
}

}  // namespace firn::kernels::FIRN_ISA
