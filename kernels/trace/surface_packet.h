// SPDX-License-Identifier: MIT
// A packet of rays before the surface of the snow: its rays at the edge of the grid, the bounds that they
// keep to along the axis that they go along most, and the cells within these. surface_packet.cpp has what
// they meet there.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

struct CellFill;  // surface_packet.cpp

inline constexpr float kMinMainShare = 0.4f;  // of every direction along the main axis
inline constexpr float kBeyond = 3e38f, kFlat = 1e-20f;

template <int kRays, bool kAny>
class SurfacePacket {
 public:
  static constexpr int kParts = kRays / kLanes;
  struct Window {  // an interval of each of the two axes beside the main one
    float low[2], high[2];
  };

  SurfacePacket(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin)
      : grid_(grid), field_(field), rays_(rays), begin_(begin), margin_(kCellMargin * grid.cell) {}

  // Strays first, then each ray moved to the grid; false if no ray meets it.
  bool load_rays();
  // Chooses the axis that the rays go along most; false if they do not all go the same way.
  bool choose_main();
  // False if the packet is or grows wider than `widest` cells, or comes upon a cell without a list of its
  // loose balls; what it has found then is not all.
  bool walk(float widest);
  void store_hits() const;
  // The rays that begin in the snow.
  void trace_others() const;

 private:
  FIRN_INLINE Mask live(int part) const { return less_equal(splat(0), best_[part]); }
  FIRN_INLINE Mask begins_inside(int part, Mask lanes) const;
  void look_ahead(float from);
  FIRN_INLINE void shorten();
  FIRN_INLINE Window window(float near, float far) const;
  FIRN_INLINE bool cells_of(const Window& window, int first, int last, int low[3], int high[3]) const;
  int clearance(const int low[3], const int high[3]) const;
  bool test_cells(const int low[3], const int high[3]);
  FIRN_INLINE bool test_loose(std::size_t place, const int cell[3]);
  FIRN_INLINE void test_surface(std::int32_t slot, const int cell[3], bool crossed);
  FIRN_INLINE Mask rise(int part, const CellFill& fill, const Floats from[3], Mask lanes, Floats begin,
                        Floats end, Floats& t) const;
  FIRN_INLINE void note(int part, Mask hit, Floats t, Ints what);

  const TraceGrid& grid_;
  const SurfaceField& field_;
  const RayView& rays_;
  std::size_t begin_;
  float margin_;                                         // m, for rounding
  Floats o_[3][kParts], d_[3][kParts], inv_[3][kParts];  // m; origins moved to the grid's edge
  Floats best_[kParts];                                  // m from the moved origin; negative: not in the grid
  Ints particle_[kParts];                                // the bits of a sorted index, or kSurfaceHit
  double entry_[kRays];
  std::uint64_t inside_ = 0;  // rays that begin in the snow, a bit each
  int main_, side_[2];        // axes
  bool forward_;
  bool found_ = false;  // something since the bounds were drawn
  // As in packet.cpp: bounds of the rays that may still meet something, at the plane from_ and per metre
  // along the main axis up to the plane to_; furthest_ is how far along it they reach. Coordinates along the
  // main axis count up in the rays' direction.
  float from_, to_, furthest_;
  Window at_, slope_;
};

template <int kRays, bool kAny>
bool SurfacePacket<kRays, kAny>::load_rays() {
  float o[3][kRays], d[3][kRays], best[kRays];
  for (int lane = 0; lane < kRays; ++lane) rays_.hit[begin_ + lane] = kNoHit;
  for (int lane = 0; lane < kRays && grid_.stray_bundles > 0; ++lane) {
    Nearest stray{rays_.t[begin_ + lane], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, begin_ + lane), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[begin_ + lane] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[begin_ + lane] = stray.t;
  }
  for (int lane = 0; lane < kRays; ++lane) {
    const Ray ray = load_ray(rays_, begin_ + lane);
    float moved[3];
    enter_grid(grid_, ray.o, ray.d, rays_.t[begin_ + lane], moved, entry_[lane], best[lane]);
    for (int a = 0; a < 3; ++a) o[a][lane] = moved[a], d[a][lane] = ray.d[a];
  }
  int within[kRays];  // begins in the grid
  for (int lane = 0; lane < kRays; ++lane) {
    if (kAny && rays_.hit[begin_ + lane] != kNoHit) best[lane] = -1;
    within[lane] = entry_[lane] <= 0 ? -1 : 0;
  }
  Mask some = mask_of_bits(0);
  for (int part = 0; part < kParts; ++part) {
    for (int a = 0; a < 3; ++a) {
      o_[a][part] = load(o[a] + part * kLanes);
      d_[a][part] = load(d[a] + part * kLanes);
      const Mask flat = less(abs(d_[a][part]), splat(kFlat));
      inv_[a][part] = select(flat, copy_sign(splat(1 / kFlat), d_[a][part]), 1 / d_[a][part]);
    }
    best_[part] = load(best + part * kLanes);
    particle_[part] = splat_int(-1);
    const Mask here = live(part) & equal(load(within + part * kLanes), splat_int(-1));
    if (any(here)) {
      const Mask inside = begins_inside(part, here);
      inside_ |= static_cast<std::uint64_t>(lane_bits(inside)) << (part * kLanes);
      best_[part] = select(inside, splat(-1), best_[part]);
    }
    some = some | live(part);
  }
  return any(some);
}

template <int kRays, bool kAny>
FIRN_INLINE Mask SurfacePacket<kRays, kAny>::begins_inside(int part, Mask lanes) const {
  Ints cell[3];
  Floats u[3];
  for (int a = 0; a < 3; ++a) {
    const Floats last = splat(static_cast<float>(grid_.cells[a] - 1)), at = o_[a][part] * grid_.inv_cell;
    cell[a] = __builtin_convertvector(max(min(at, last), splat(0)), Ints);
    u[a] = min(max(at - to_float(cell[a]), splat(0)), splat(1));
  }
  const Ints brick = ((cell[0] >> 2) * grid_.bricks[1] + (cell[1] >> 2)) * grid_.bricks[2] + (cell[2] >> 2);
  const Ints slot = gather(grid_.slot, brick, lanes);
  lanes = lanes & !less(slot, splat_int(0));
  if (!any(lanes)) return lanes;
  const Ints first = slot * kBrickCorners + (cell[0] & 3) * (kCornerSide * kCornerSide) +
                     (cell[1] & 3) * kCornerSide + (cell[2] & 3);
  Floats corner[8];
  for (int k = 0; k < 8; ++k) {
    const int offset = (k >> 2) * kCornerSide * kCornerSide + (k >> 1 & 1) * kCornerSide + (k & 1);
    corner[k] = gather(field_.fill, first + offset, lanes);
  }
  for (int a = 2, n = 4; a >= 0; --a, n /= 2) {  // z, then y, then x
    for (int k = 0; k < n; ++k) corner[k] = fma(u[a], corner[2 * k + 1] - corner[2 * k], corner[2 * k]);
  }
  return lanes & less_equal(splat(field_.level), corner[0]);
}

template <int kRays, bool kAny>
bool SurfacePacket<kRays, kAny>::choose_main() {
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
  look_ahead(-kBeyond);
  return true;
}

// The bounds of the rays that reach beyond `from` along the main axis.
template <int kRays, bool kAny>
void SurfacePacket<kRays, kAny>::look_ahead(float from) {
  Floats nearest = splat(kBeyond), furthest = splat(-kBeyond);
  Mask ahead[kParts];
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    const Floats end = fma(best_[part], speed, along);
    ahead[part] = live(part) & less_equal(splat(from), end);
    nearest = min(nearest, select(ahead[part], along, splat(kBeyond)));
    furthest = max(furthest, select(ahead[part], end, splat(-kBeyond)));
  }
  furthest_ = greatest_lane(furthest);
  const float least = -greatest_lane(-nearest),
              edge = forward_ ? grid_.cell * static_cast<float>(grid_.cells[main_]) : 0;
  from_ = least > from ? least : from;
  to_ = furthest_ < edge ? furthest_ : edge;
  to_ = to_ > from_ + grid_.cell ? to_ : from_ + grid_.cell;
  for (int side = 0; side < 2; ++side) {
    Floats low[2] = {splat(kBeyond), splat(kBeyond)}, high[2] = {splat(-kBeyond), splat(-kBeyond)};
    for (int part = 0; part < kParts; ++part) {
      const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
      const Floats slope = d_[side_[side]][part] * (forward_ ? inv_[main_][part] : -inv_[main_][part]);
      for (int plane = 0; plane < 2; ++plane) {
        const Floats at = fma(splat(plane == 0 ? from_ : to_) - along, slope, o_[side_[side]][part]);
        low[plane] = min(low[plane], select(ahead[part], at, splat(kBeyond)));
        high[plane] = max(high[plane], select(ahead[part], at, splat(-kBeyond)));
      }
    }
    at_.low[side] = -greatest_lane(-low[0]);
    at_.high[side] = greatest_lane(high[0]);
    const float length = to_ - from_;
    slope_.low[side] = (-greatest_lane(-low[1]) - at_.low[side]) / length;
    slope_.high[side] = (greatest_lane(high[1]) - at_.high[side]) / length;
  }
}

// How far the rays reach, once some have found something.
template <int kRays, bool kAny>
FIRN_INLINE void SurfacePacket<kRays, kAny>::shorten() {
  Floats furthest = splat(-kBeyond);
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    furthest = max(furthest, select(live(part), fma(best_[part], speed, along), splat(-kBeyond)));
  }
  furthest_ = greatest_lane(furthest);
}

// The rays' bounds between two planes, with a margin.
template <int kRays, bool kAny>
FIRN_INLINE typename SurfacePacket<kRays, kAny>::Window SurfacePacket<kRays, kAny>::window(float near,
                                                                                           float far) const {
  const float length = to_ - from_;
  const auto inside = [&](float along) { return along < 0 ? 0 : along > length ? length : along; };
  const float first = inside(near - from_), last = inside(far - from_);
  Window w;
  for (int side = 0; side < 2; ++side) {
    const float low = slope_.low[side] < 0 ? last : first, high = slope_.high[side] < 0 ? first : last;
    w.low[side] = at_.low[side] + low * slope_.low[side] - margin_;
    w.high[side] = at_.high[side] + high * slope_.high[side] + margin_;
  }
  return w;
}

// The cells of slices first to last (counted up the axis) within the window; false if there are none.
template <int kRays, bool kAny>
FIRN_INLINE bool SurfacePacket<kRays, kAny>::cells_of(const Window& w, int first, int last, int low[3],
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
int SurfacePacket<kRays, kAny>::clearance(const int low[3], const int high[3]) const {
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

}  // namespace firn::kernels::FIRN_ISA
