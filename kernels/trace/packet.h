// SPDX-License-Identifier: MIT
// A packet of coherent rays that goes through the grid together (Wald et al. 2006, "Ray tracing animated
// scenes using coherent grid traversal"): along the axis that its rays go along most, a slab of bricks at a
// time. The rays' common bounds, widened by how far away a ray can meet what is there, name the cells to look
// into; what they hold is for ball_packet.cpp and surface_packet.cpp to say.
//
//     slab of bricks   rays     o---->---------
//     packet,
//     +---+---+---+        o---->---------        Bounds are drawn anew when a slab has shortened some rays.
//     |   |###|###|  <- cells within the bounds   Wide packets go by other ways.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr int kRays = 64;              // of a packet
inline constexpr float kMinMainShare = 0.4f;  // of every direction along the main axis
inline constexpr float kFar = 3e38f;
inline constexpr float kBlocked = -2;  // m, of rays that something blocks: a reach of less than nothing

// An interval of each of the two axes beside the main one.
struct Window {
  float low[2], high[2];
};

// Cells along the main axis, and those within the packet's bounds of each axis; both ends are in it.
struct CellRange {
  int low[3], high[3];
};

// What became of a packet in a slab: it goes on, or no ray of it does, or its rays must go by other ways.
enum class Slab { passed, ended, declined };

// kAny: whether any hit will do. Packets of a kind derive from it and have
//   kWidest   cells, as TraceGrid's widest_packet
//   Slab meet(int slab, const CellRange&)   tests these cells, which are those of four slices from `slab` on
// and call shorten() when they are done with what found_ tells of. They may have
//   void set_aside()      takes rays out that begin where this packet cannot follow them
//   void bounds_drawn()   hears of it
template <class Kind, bool kAny>
class Packet {
 public:
  // False if the rays are not coherent, or the packet is or grows too wide (TraceGrid), or it declines:
  // nothing is found then (a stray that shortened a ray is found again, within its reach).
  bool trace();

 protected:
  static constexpr int kParts = kRays / kLanes;

  // reach: m, from what is met to its place in the grid.
  Packet(const TraceGrid& grid, const RayView& rays, std::size_t begin, float reach)
      : grid_(grid), rays_(rays), begin_(begin), reach_(reach) {}

  FIRN_INLINE Mask live(int part) const { return less_equal(splat(0), best_[part]); }
  void set_aside() {}
  void bounds_drawn() {}
  // How far the rays reach, once some have found something.
  FIRN_INLINE void shorten();
  // The coordinate along the main axis at the k-th cell that the rays come to.
  FIRN_INLINE float plane(int k) const {
    return static_cast<float>(forward_ ? k : k - grid_.cells[main_]) * grid_.cell;
  }
  // Where the rays can be while they are in slices k to k + count, widened by the reach.
  FIRN_INLINE Window window(int k, int count) const;
  FIRN_INLINE bool wide(const Window& w) const {
    const float widest = grid_.widest_packet > 0 ? grid_.widest_packet : Kind::kWidest;
    const float most = widest * grid_.cell + 2 * reach_;
    return w.high[0] - w.low[0] > most || w.high[1] - w.low[1] > most;
  }
  // The cells of these slices within the window; false if there are none.
  FIRN_INLINE bool cells_of(const Window& window, int k, int count, CellRange& cells) const;

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t begin_;
  float reach_;                         // m
  int first_ = 0;                       // slice that the rays come to
  Floats o_[3][kParts], d_[3][kParts];  // m; origins moved to the grid's edge
  Floats entry_[kParts];                // m, from the ray's origin to the moved one
  Floats best_[kParts];                 // m from the moved origin; negative: not in the grid
  Ints particle_[kParts];               // the bits of a sorted index, kSurfaceHit or kNoHit; not of any hits
  int main_, side_[2];                  // axes
  bool forward_;
  // The coordinate along the main axis, which counts up in the rays' direction: where rays begin, its growth
  // a metre of the ray, and how far they go aside a metre of it.
  Floats start_[kParts], speed_[kParts], tilt_[2][kParts];
  bool found_ = false;  // something since the reach was last shortened
  // Bounds of the rays that may still meet something: at the plane from_ and per metre along the main axis
  // up to the plane to_; furthest_ is how far along it they reach.
  float from_, to_, furthest_;
  Window at_, slope_;

 private:
  std::int32_t* hits() const { return reinterpret_cast<std::int32_t*>(rays_.hit + begin_); }
  // Strays first, then each ray moved to the grid.
  void load_rays();
  bool any_live() const;
  // Chooses the axis that the rays go along most; false if they do not all go the same way.
  bool choose_main();
  void look_ahead(float from);
  float steepest() const;
  int clearance(const CellRange& cells) const;
  bool walk();
  void store_hits() const;

  bool shortened_ = false;  // some ray, since the bounds were drawn
};

template <class Kind, bool kAny>
bool Packet<Kind, kAny>::trace() {
  load_rays();
  static_cast<Kind*>(this)->set_aside();
  if (any_live() && !(choose_main() && walk())) return false;
  store_hits();
  return true;
}

// Asks for what the next packet will read there.
FIRN_INLINE void fetch_next(const float* column) { __builtin_prefetch(column + kRays); }

template <class Kind, bool kAny>
void Packet<Kind, kAny>::load_rays() {
  const Ints none = splat_int(static_cast<std::int32_t>(kNoHit));
  for (int part = 0; part < kParts; ++part) store(hits() + part * kLanes, none);
  for (int lane = 0; lane < kRays && grid_.stray_bundles > 0; ++lane) {
    Nearest stray{rays_.t[begin_ + lane], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, begin_ + lane), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[begin_ + lane] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[begin_ + lane] = stray.t;
  }
  for (int part = 0; part < kParts; ++part) {
    const std::size_t from = begin_ + static_cast<std::size_t>(part * kLanes);
    Floats o[3], d[3], moved[3];
    for (int a = 0; a < 3; ++a) {
      o[a] = load(rays_.origin[a] + from);
      d_[a][part] = d[a] = load(rays_.direction[a] + from);
      fetch_next(rays_.origin[a] + from);
      fetch_next(rays_.direction[a] + from);
    }
    fetch_next(rays_.t + from);
    entry_[part] = enter_grid(grid_, o, d, load(rays_.t + from), moved, best_[part]);
    for (int a = 0; a < 3; ++a) o_[a][part] = moved[a];
    particle_[part] = none;
    if (kAny) best_[part] = select(equal(load(hits() + part * kLanes), none), best_[part], splat(kBlocked));
  }
}

template <class Kind, bool kAny>
bool Packet<Kind, kAny>::any_live() const {
  Mask some = live(0);
  for (int part = 1; part < kParts; ++part) some = some | live(part);
  return any(some);
}

template <class Kind, bool kAny>
bool Packet<Kind, kAny>::choose_main() {
  int part = 0;
  while (!any(live(part))) ++part;
  const int first = __builtin_ctz(static_cast<unsigned>(lane_bits(live(part))));
  const auto size = [&](int a) { return __builtin_fabsf(d_[a][part][first]); };
  main_ = size(0) > size(1) ? (size(0) > size(2) ? 0 : 2) : (size(1) > size(2) ? 1 : 2);
  side_[0] = main_ == 0 ? 1 : 0;
  side_[1] = main_ == 2 ? 1 : 2;
  forward_ = d_[main_][part][first] > 0;
  for (part = 0; part < kParts; ++part) {
    start_[part] = forward_ ? o_[main_][part] : -o_[main_][part];
    speed_[part] = forward_ ? d_[main_][part] : -d_[main_][part];
    if (any(live(part) & !less(splat(kMinMainShare), speed_[part]))) return false;
    const Floats per_metre = splat(1) / speed_[part];
    for (int side = 0; side < 2; ++side) tilt_[side][part] = d_[side_[side]][part] * per_metre;
  }
  look_ahead(-kFar);
  return true;
}

// The bounds of the rays that reach beyond `from` along the main axis.
template <class Kind, bool kAny>
void Packet<Kind, kAny>::look_ahead(float from) {
  Floats nearest = splat(kFar), furthest = splat(-kFar);
  Mask ahead[kParts];
  for (int part = 0; part < kParts; ++part) {
    const Floats end = fma(best_[part], speed_[part], start_[part]);
    ahead[part] = live(part) & less_equal(splat(from), end);
    nearest = min(nearest, select(ahead[part], start_[part], splat(kFar)));
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
      for (int plane = 0; plane < 2; ++plane) {
        const Floats way = splat(plane == 0 ? from_ : to_) - start_[part];
        const Floats at = fma(way, tilt_[side][part], o_[side_[side]][part]);
        low[plane] = min(low[plane], select(ahead[part], at, splat(kFar)));
        high[plane] = max(high[plane], select(ahead[part], at, splat(-kFar)));
      }
    }
    at_.low[side] = -greatest_lane(-low[0]);
    at_.high[side] = greatest_lane(high[0]);
    const float length = to_ - from_;
    slope_.low[side] = (-greatest_lane(-low[1]) - at_.low[side]) / length;
    slope_.high[side] = (greatest_lane(high[1]) - at_.high[side]) / length;
  }
  shortened_ = false;
  static_cast<Kind*>(this)->bounds_drawn();
}

template <class Kind, bool kAny>
FIRN_INLINE void Packet<Kind, kAny>::shorten() {
  if (!found_) return;
  Floats furthest = splat(-kFar);
  for (int part = 0; part < kParts; ++part) {
    const Floats end = fma(best_[part], speed_[part], start_[part]);
    furthest = max(furthest, select(live(part), end, splat(-kFar)));
  }
  furthest_ = greatest_lane(furthest);
  found_ = false;
  shortened_ = true;
}

// A bound on the way from one plane to another is linear, since every ray is.
template <class Kind, bool kAny>
FIRN_INLINE Window Packet<Kind, kAny>::window(int k, int count) const {
  const float length = to_ - from_;
  const auto inside = [&](float along) { return along < 0 ? 0 : along > length ? length : along; };
  const float first = inside(plane(k) - reach_ - from_), last = inside(plane(k + count) + reach_ - from_);
  Window w;
  for (int side = 0; side < 2; ++side) {
    const float low = slope_.low[side] < 0 ? last : first, high = slope_.high[side] < 0 ? first : last;
    w.low[side] = at_.low[side] + low * slope_.low[side] - reach_;
    w.high[side] = at_.high[side] + high * slope_.high[side] + reach_;
  }
  return w;
}

template <class Kind, bool kAny>
FIRN_INLINE bool Packet<Kind, kAny>::cells_of(const Window& w, int k, int count, CellRange& cells) const {
  cells.low[main_] = forward_ ? k : grid_.cells[main_] - k - count;
  cells.high[main_] = cells.low[main_] + count - 1;
  for (int side = 0; side < 2; ++side) {
    const int a = side_[side];
    const float from = w.low[side] * grid_.inv_cell, to = w.high[side] * grid_.inv_cell;
    const auto end = static_cast<float>(grid_.cells[a]);
    if (!(to >= 0 && from < end)) return false;
    cells.low[a] = from > 0 ? static_cast<int>(from) : 0;
    cells.high[a] = to < end ? static_cast<int>(to) : grid_.cells[a] - 1;
  }
  return true;
}

// How many bricks, beginning with those of these cells, are empty whichever way one goes; 0: one of them is
// not.
template <class Kind, bool kAny>
int Packet<Kind, kAny>::clearance(const CellRange& cells) const {
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
template <class Kind, bool kAny>
float Packet<Kind, kAny>::steepest() const {
  float most = 1;
  for (int side = 0; side < 2; ++side) {
    const float low = __builtin_fabsf(slope_.low[side]), high = __builtin_fabsf(slope_.high[side]);
    most = low > most ? low : most;
    most = high > most ? high : most;
  }
  return most;
}

// Slab of bricks after slab of bricks.
template <class Kind, bool kAny>
bool Packet<Kind, kAny>::walk() {
  const float begin = from_ - reach_ - plane(0), slope = steepest();
  first_ = begin > 0 ? static_cast<int>(begin * grid_.inv_cell) : 0;
  for (int slab = first_ & ~3; slab < grid_.cells[main_]; slab += kBrickCells) {
    if (plane(slab) - reach_ > furthest_) return true;
    CellRange cells;
    if (!cells_of(window(slab, kBrickCells), slab, kBrickCells, cells)) continue;
    if (const int empty = clearance(cells); empty > 0) {
      // Every brick nearer than `empty` is empty, and the rays go aside by their slope at most.
      slab += kBrickCells * static_cast<int>(static_cast<float>(empty - 1) / slope);
      continue;
    }
    const Slab met = static_cast<Kind*>(this)->meet(slab, cells);
    if (met != Slab::passed) return met == Slab::ended;
    if (shortened_) look_ahead(plane(slab + kBrickCells) - reach_);
  }
  return true;
}

template <class Kind, bool kAny>
void Packet<Kind, kAny>::store_hits() const {
  const Ints none = splat_int(static_cast<std::int32_t>(kNoHit));
  for (int part = 0; part < kParts; ++part) {
    std::int32_t* const hit = hits() + part * kLanes;
    if (kAny) {
      store(hit, select(less_equal(best_[part], splat(kBlocked)), splat_int(0), none));
      continue;
    }
    const Mask nothing = equal(particle_[part], none);  // but perhaps a stray
    store(hit, select(nothing, load(hit), particle_[part]));
    float* const t = rays_.t + begin_ + part * kLanes;
    store(t, select(nothing, load(t), entry_[part] + best_[part]));
  }
}

// Rays [begin, end) by packet(from), kRays of them; where it declines, and what is left, by others(from, to):
// as many as follow one another, since they go best together.
template <class Trace, class Others>
void trace_in_packets(std::size_t begin, std::size_t end, Trace&& packet, Others&& others) {
  std::size_t declined = begin;  // from here on
  const auto trace_declined = [&](std::size_t to) {
    if (declined < to) others(declined, to);
  };
  for (; begin + kRays <= end; begin += kRays) {
    if (!packet(begin)) continue;
    trace_declined(begin);
    declined = begin + kRays;
  }
  trace_declined(end);
}

}  // namespace firn::kernels::FIRN_ISA
