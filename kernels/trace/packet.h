// SPDX-License-Identifier: MIT
// A packet of coherent rays: what it holds, how it takes up its rays and meets one ball. How it goes through
// the grid is packet.cpp's.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

inline constexpr float kMinMainShare = 0.4f;  // of every direction along the main axis
inline constexpr float kFar = 3e38f;
inline constexpr float kBlocked = -2;  // m, of rays that something blocks: a reach of less than nothing

// An interval of each of the two axes beside the main one.
struct Window {
  float low[2], high[2];
};

template <int kRays, bool kAny>
class Packet {
 public:
  static constexpr int kParts = kRays / kLanes < 1 ? 1 : kRays / kLanes;

  Packet(const TraceGrid& grid, const RayView& rays, std::size_t begin)
      : grid_(grid), rays_(rays), begin_(begin), reach_(grid.max_radius + kCellMargin * grid.cell) {}

  // Strays first, then each ray moved to the grid; false if no ray meets it.
  bool load_rays();
  // Chooses the axis that the rays go along most; false if they do not all go the same way.
  bool choose_main();
  // False if the packet is or grows wider than `widest` cells beside the reach; what it has found then is not
  // all.
  bool walk(float widest);
  void store_hits() const;

 private:
  FIRN_INLINE Mask live(int part) const { return less_equal(splat(0), best_[part]); }
  void look_ahead(float from);
  FIRN_INLINE void shorten();
  Window window(float near, float far) const;
  bool cells_of(const Window& window, int first, int last, int low[3], int high[3]) const;
  int clearance(const int low[3], const int high[3]) const;
  void collect(const int low[3], const int high[3], float plane);
  FIRN_INLINE void collect_run(std::uint32_t begin, std::uint32_t end, float plane);
  FIRN_INLINE Mask in_bounds(std::uint32_t begin, int some, Floats along) const;
  bool test_slab(float plane);
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
  static constexpr int kMostCollected = 1024;

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t begin_;
  float reach_;                         // m, how far from a ball's centre a ray can meet it
  Floats o_[3][kParts], d_[3][kParts];  // m; origins moved to the grid's edge
  Floats best_[kParts];                 // m from the moved origin; negative: not in the grid
  Ints particle_[kParts];               // the bits of a sorted index
  double entry_[kRays];
  Meeting meeting_[kAny ? 1 : kMostMeetings];
  int meetings_ = 0;
  // Balls of a slab within the bounds, and their slices, from 0 on.
  std::int32_t ball_[kMostCollected + kLanes], slice_[kMostCollected + kLanes];
  int collected_ = 0;
  int main_, side_[2];  // axes
  bool forward_;
  bool found_ = false;  // a ball since the bounds were drawn
  // Bounds of the rays that may still meet something: at the plane from_ and per metre along the main axis
  // up to the plane to_; furthest_ is how far along it they reach. The coordinate along the main axis counts
  // up in the rays' direction.
  float from_, to_, furthest_;
  Window at_, slope_;
  Window near_;  // at_, widened by what a ball reaches across the bound
};

template <int kRays, bool kAny>
bool Packet<kRays, kAny>::load_rays() {
  float o[3][kRays], d[3][kRays], best[kRays];
  for (int lane = 0; lane < kRays; ++lane) rays_.hit[begin_ + lane] = kNoHit;
  for (int lane = 0; lane < kRays && grid_.stray_bundles > 0; ++lane) {
    Nearest stray{rays_.t[begin_ + lane], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, begin_ + lane), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[begin_ + lane] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[begin_ + lane] = stray.t;
  }
  move_to_grid(grid_, rays_, begin_, kRays, {o[0], o[1], o[2]}, {d[0], d[1], d[2]}, entry_, best);
  float some = -1;
  for (int lane = 0; lane < kRays; ++lane) {
    if (kAny && rays_.hit[begin_ + lane] != kNoHit) best[lane] = -1;
    some = best[lane] > some ? best[lane] : some;
  }
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

template <int kRays, bool kAny>
FIRN_INLINE void Packet<kRays, kAny>::test_ball(std::uint32_t b) {
  const Floats x = splat(grid_.x[b]), y = splat(grid_.y[b]), z = splat(grid_.z[b]);
  const float r = grid_.radius == nullptr ? grid_.max_radius : grid_.radius[b];
  const Floats r2 = splat(r * r);
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

template <int kRays, bool kAny>
FIRN_INLINE Floats Packet<kRays, kAny>::seen(int part, Floats x, Floats y, Floats z, Floats r2,
                                             Floats& along) const {
  const Floats c[3] = {x - o_[0][part], y - o_[1][part], z - o_[2][part]};
  const Floats d[3] = {d_[0][part], d_[1][part], d_[2][part]};
  return project(c, d, r2, along);
}

// Whether a ball is met is asked first, where it is entered later: so no branch hangs on each.
template <int kRays, bool kAny>
void Packet<kRays, kAny>::settle() {
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

template <int kRays, bool kAny>
void Packet<kRays, kAny>::store_hits() const {
  float best[kRays];
  std::int32_t particle[kRays];
  for (int part = 0; part < kParts; ++part) {
    store(best + part * kLanes, best_[part]);
    store(particle + part * kLanes, particle_[part]);
  }
  for (int lane = 0; lane < kRays; ++lane) {
    if (kAny) {
      if (best[lane] == kBlocked) rays_.hit[begin_ + lane] = 0;
    } else if (particle[lane] != -1) {
      rays_.t[begin_ + lane] = static_cast<float>(entry_[lane] + best[lane]);
      rays_.hit[begin_ + lane] = static_cast<std::uint32_t>(particle[lane]);
    }
  }
}

}  // namespace firn::kernels::FIRN_ISA
