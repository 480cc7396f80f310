// SPDX-License-Identifier: MIT
// Coherent rays, 64 or 16 at a time (Wald et al. 2006, "Ray tracing animated scenes using coherent grid
// traversal"): the packet walks the grid slice by slice along its main axis. In each slice the rays' common
// bounds, widened by the largest radius, name the cells whose balls can be met; each ball is broadcast
// against the rays.
//
//     slice k          rays     o---->---------      Lists by centre do here: each ball is tested once a
//     packet,
//     +---+---+---+        o---->---------           where lists by overlap would test it once a cell.
//     |   |###|###|  <- cells within the bounds
//
// A packet whose bounds are wide against the cells is split, and rays that are not coherent go by stream.cpp.
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

void closest(const TraceGrid&, const RayView&, std::size_t, std::size_t);  // stream.cpp

namespace {

constexpr int kLarge = 64, kSmall = 16;  // rays
constexpr float kMinMainShare = 0.4f;    // of every direction along the main axis
constexpr float kFar = 3e38f;

FIRN_INLINE float lowest_of(Mask m, Floats v) { return -greatest_lane(select(m, -v, splat(-kFar))); }
FIRN_INLINE float highest_of(Mask m, Floats v) { return greatest_lane(select(m, v, splat(-kFar))); }

// An interval of each of the two axes beside the main one.
struct Window {
  float low[2], high[2];
};

template <int kRays>
class Packet {
 public:
  static constexpr int kParts = kRays / kLanes < 1 ? 1 : kRays / kLanes;

  Packet(const TraceGrid& grid, const RayView& rays, std::size_t begin)
      : grid_(grid), rays_(rays), begin_(begin), reach_(grid.max_radius + kCellMargin * grid.cell) {}

  // Strays first, then each ray moved to the grid; false if no ray meets it.
  bool load_rays();
  // Chooses the axis that the rays go along most; false if they do not all go the same way.
  bool choose_main();
  // Cells across the packet where it is widest in the grid.
  float width() const;
  void walk();
  void store_hits() const;

 private:
  FIRN_INLINE Mask live(int part) const { return less_equal(splat(0), best_[part]); }
  void look_ahead(float from);
  FIRN_INLINE void shorten();
  Window window(float near, float far) const;
  bool cells_of(const Window& window, int first, int last, int low[3], int high[3]) const;
  bool any_brick(const int low[3], const int high[3]) const;
  void test_cells(const int low[3], const int high[3]);
  FIRN_INLINE void test_balls(std::uint32_t begin, std::uint32_t end);

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t begin_;
  float reach_;                         // m, how far from a ball's centre a ray can meet it
  Floats o_[3][kParts], d_[3][kParts];  // m; origins moved to the grid's edge
  Floats best_[kParts];                 // m from the moved origin; negative: not in the grid
  Ints particle_[kParts];               // the bits of a sorted index
  double entry_[kRays];
  int main_, side_[2];  // axes
  bool forward_;
  bool found_ = false;  // a ball since the bounds were drawn
  // Bounds of the rays that may still meet something: at the plane from_ and per metre along the main axis
  // from there; furthest_ is how far along it they reach. The coordinate along the main axis counts up in the
  // rays' direction.
  float from_, furthest_;
  Window at_, slope_;
};

template <int kRays>
bool Packet<kRays>::load_rays() {
  float o[3][kRays], d[3][kRays], best[kRays];
  for (int lane = 0; lane < kRays && grid_.stray_bundles > 0; ++lane) {
    Nearest stray{rays_.t[begin_ + lane], kNoHit};
    test_bundles<false>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, begin_ + lane), stray);
    rays_.t[begin_ + lane] = stray.t;
    rays_.hit[begin_ + lane] = stray.particle;
  }
  if (grid_.stray_bundles == 0) {
    for (int lane = 0; lane < kRays; ++lane) rays_.hit[begin_ + lane] = kNoHit;
  }
  float some = -1;
  for (int lane = 0; lane < kRays; ++lane) {
    const Ray ray = load_ray(rays_, begin_ + lane);
    float moved[3];
    enter_grid(grid_, ray.o, ray.d, rays_.t[begin_ + lane], moved, entry_[lane], best[lane]);
    for (int a = 0; a < 3; ++a) o[a][lane] = moved[a], d[a][lane] = ray.d[a];
  }
  for (int lane = 0; lane < kRays; ++lane) some = best[lane] > some ? best[lane] : some;
  for (int part = 0; part < kParts; ++part) {
    for (int a = 0; a < 3; ++a) {
      o_[a][part] = load(o[a] + part * kLanes);
      d_[a][part] = load(d[a] + part * kLanes);
    }
    best_[part] = load(best + part * kLanes);
    particle_[part] = splat_int(-1);
  }
  return some >= 0;
}

template <int kRays>
bool Packet<kRays>::choose_main() {
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
template <int kRays>
void Packet<kRays>::look_ahead(float from) {
  float nearest = kFar;
  furthest_ = -kFar;
  Floats along[kParts], end[kParts];
  Mask ahead[kParts];
  for (int part = 0; part < kParts; ++part) {
    along[part] = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    end[part] = fma(best_[part], speed, along[part]);
    ahead[part] = live(part) & less_equal(splat(from), end[part]);
    if (!any(ahead[part])) continue;
    const float low = lowest_of(ahead[part], along[part]), high = highest_of(ahead[part], end[part]);
    nearest = low < nearest ? low : nearest;
    furthest_ = high > furthest_ ? high : furthest_;
  }
  from_ = nearest > from ? nearest : from;
  for (int side = 0; side < 2; ++side) {
    at_.low[side] = slope_.low[side] = kFar;
    at_.high[side] = slope_.high[side] = -kFar;
    for (int part = 0; part < kParts; ++part) {
      if (!any(ahead[part])) continue;
      const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
      const Floats slope = d_[side_[side]][part] / speed;
      const Floats at = fma(splat(from_) - along[part], slope, o_[side_[side]][part]);
      const float values[4] = {lowest_of(ahead[part], at), highest_of(ahead[part], at),
                               lowest_of(ahead[part], slope), highest_of(ahead[part], slope)};
      at_.low[side] = values[0] < at_.low[side] ? values[0] : at_.low[side];
      at_.high[side] = values[1] > at_.high[side] ? values[1] : at_.high[side];
      slope_.low[side] = values[2] < slope_.low[side] ? values[2] : slope_.low[side];
      slope_.high[side] = values[3] > slope_.high[side] ? values[3] : slope_.high[side];
    }
  }
}

// How far the rays reach, once some have found something.
template <int kRays>
FIRN_INLINE void Packet<kRays>::shorten() {
  Floats furthest = splat(-kFar);
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    furthest = max(furthest, select(live(part), fma(best_[part], speed, along), splat(-kFar)));
  }
  furthest_ = greatest_lane(furthest);
}

// What the rays can be between two planes of the main axis, near <= far, widened by the reach.
template <int kRays>
FIRN_INLINE Window Packet<kRays>::window(float near, float far) const {
  Window w;
  const float first = near - from_, last = far - from_;
  for (int side = 0; side < 2; ++side) {
    const float low0 = at_.low[side] + first * (first < 0 ? slope_.high[side] : slope_.low[side]);
    const float low1 = at_.low[side] + last * (last < 0 ? slope_.high[side] : slope_.low[side]);
    const float high0 = at_.high[side] + first * (first < 0 ? slope_.low[side] : slope_.high[side]);
    const float high1 = at_.high[side] + last * (last < 0 ? slope_.low[side] : slope_.high[side]);
    w.low[side] = (low0 < low1 ? low0 : low1) - reach_;
    w.high[side] = (high0 > high1 ? high0 : high1) + reach_;
  }
  return w;
}

template <int kRays>
float Packet<kRays>::width() const {
  const float end = furthest_ < kFar ? furthest_ : from_;
  const float room = grid_.cell * static_cast<float>(grid_.cells[main_]);
  const Window w = window(from_, end - from_ < room ? end : from_ + room);
  float widest = 0;
  for (int side = 0; side < 2; ++side) {
    const float spread = (at_.high[side] - at_.low[side] +
                          (slope_.high[side] - slope_.low[side]) * (w.high[side] > w.low[side] ? room : 0)) *
                         grid_.inv_cell;
    widest = spread > widest ? spread : widest;
  }
  return widest;
}

// The cells of slices first to last (counted up the axis) within the window; false if there are none.
template <int kRays>
FIRN_INLINE bool Packet<kRays>::cells_of(const Window& w, int first, int last, int low[3],
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

template <int kRays>
bool Packet<kRays>::any_brick(const int low[3], const int high[3]) const {
  for (int x = low[0] >> 2; x <= high[0] >> 2; ++x) {
    for (int y = low[1] >> 2; y <= high[1] >> 2; ++y) {
      for (int z = low[2] >> 2; z <= high[2] >> 2; ++z) {
        if (grid_.slot[brick_at(grid_, x, y, z)] >= 0) return true;
      }
    }
  }
  return false;
}

template <int kRays>
FIRN_INLINE void Packet<kRays>::test_balls(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t b = begin; b < end; ++b) {
    const Floats x = splat(grid_.x[b]), y = splat(grid_.y[b]), z = splat(grid_.z[b]);
    const Floats r2 = splat(grid_.radius[b] * grid_.radius[b]);
    Floats along[kParts], depth2[kParts], deepest = splat(-1);
#pragma GCC unroll 16
    for (int part = 0; part < kParts; ++part) {
      const Floats c[3] = {x - o_[0][part], y - o_[1][part], z - o_[2][part]};
      const Floats d[3] = {d_[0][part], d_[1][part], d_[2][part]};
      depth2[part] = project(c, d, r2, along[part]);
      deepest = max(deepest, depth2[part]);
    }
    if (!any(less_equal(splat(0), deepest))) continue;
    found_ = true;
    const Ints index = splat_int(static_cast<std::int32_t>(b));
#pragma GCC unroll 16
    for (int part = 0; part < kParts; ++part) {
      const Floats t = along[part] - sqrt(depth2[part]);  // NaN where missed: every comparison is then false
      // Flipping the sign bit orders unsigned indices as signed ones.
      const Mask lower = less(index ^ INT32_MIN, particle_[part] ^ INT32_MIN);
      const Mask nearer = less(splat(0), t) & (less(t, best_[part]) | (less_equal(t, best_[part]) & lower));
      best_[part] = select(nearer, t, best_[part]);
      particle_[part] = select(nearer, index, particle_[part]);
    }
  }
}

template <int kRays>
void Packet<kRays>::test_cells(const int low[3], const int high[3]) {
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2];) {
        const int last = (z | 3) < high[2] ? (z | 3) : high[2];  // in this brick: one run of balls
        const std::int32_t slot = grid_.slot[brick_at(grid_, x >> 2, y >> 2, z >> 2)];
        if (slot >= 0) {
          const std::size_t place = cell_at(slot, x, y, z);
          test_balls(grid_.cell_start[place], grid_.cell_start[place + (last - z) + 1]);
        }
        z = last + 1;
      }
    }
  }
}

// Slab of bricks after slab of bricks, slice after slice. "Along" counts in the rays' direction.
template <int kRays>
void Packet<kRays>::walk() {
  const int cells = grid_.cells[main_];
  const auto plane = [&](int k) { return static_cast<float>(forward_ ? k : k - cells) * grid_.cell; };
  const float begin = from_ - reach_ - plane(0);
  const int first = begin > 0 ? static_cast<int>(begin * grid_.inv_cell) : 0;
  for (int slab = first & ~3; slab < cells; slab += kBrickCells) {
    if (plane(slab) - reach_ > furthest_) return;
    int low[3], high[3];
    const auto slices = [&](int k, int count, int& least, int& most) {
      least = forward_ ? k : cells - k - count;
      most = least + count - 1;
    };
    int least, most;
    slices(slab, kBrickCells, least, most);
    if (!cells_of(window(plane(slab) - reach_, plane(slab + kBrickCells) + reach_), least, most, low, high))
      continue;
    if (!any_brick(low, high)) continue;
    bool look_ahead_needed = false;
    for (int k = slab; k < slab + kBrickCells; ++k) {
      if (plane(k) - reach_ > furthest_) return;
      slices(k, 1, least, most);
      if (!cells_of(window(plane(k) - reach_, plane(k + 1) + reach_), least, most, low, high)) continue;
      found_ = false;
      test_cells(low, high);
      if (found_) {
        look_ahead_needed = true;
        shorten();
      }
    }
    if (look_ahead_needed) look_ahead(plane(slab + kBrickCells) - reach_);
  }
}

template <int kRays>
void Packet<kRays>::store_hits() const {
  float best[kRays];
  std::int32_t particle[kRays];
  for (int part = 0; part < kParts; ++part) {
    store(best + part * kLanes, best_[part]);
    store(particle + part * kLanes, particle_[part]);
  }
  for (int lane = 0; lane < kRays; ++lane) {
    if (particle[lane] == -1) continue;
    rays_.t[begin_ + lane] = static_cast<float>(entry_[lane] + best[lane]);
    rays_.hit[begin_ + lane] = static_cast<std::uint32_t>(particle[lane]);
  }
}

// False if the packet is too wide or not coherent; nothing is found then (a stray that shortened a ray is
// found again: it lies within the reach).
template <int kRays>
bool trace_packet(const TraceGrid& grid, const RayView& rays, std::size_t begin, float widest) {
  Packet<kRays> packet(grid, rays, begin);
  if (!packet.load_rays()) return true;
  if (!packet.choose_main() || packet.width() > widest) return false;
  packet.walk();
  packet.store_hits();
  return true;
}

// Cells across a packet beyond which fewer rays at a time are faster; from the bench.
constexpr float kWidestLarge = 3, kWidestSmall = 3;

}  // namespace

void closest_coherent(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  for (; begin + kLarge <= end; begin += kLarge) {
    if (trace_packet<kLarge>(grid, rays, begin, kWidestLarge)) continue;
    for (std::size_t part = begin; part < begin + kLarge; part += kSmall) {
      if (!trace_packet<kSmall>(grid, rays, part, kWidestSmall)) closest(grid, rays, part, part + kSmall);
    }
  }
  closest(grid, rays, begin, end);
}

}  // namespace firn::kernels::FIRN_ISA
