// SPDX-License-Identifier: MIT
// Incoherent rays: a register of them walks the grid in lock step, each lane in a cell of its own (leaping
// through empty bricks by their clearance). What a cell holds for a ray is up to `Cells`: a surface
// (surface.cpp) or a medium (medium.cpp); against balls alone rays go in waves (wave.cpp). Lanes whose rays
// are done take the next rays of the stream. A ray from outside is first moved to the grid's edge.
#pragma once
#include "kernels/trace/ball_test.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

// The rays in the lanes; origins at the grid's edge.
struct LaneRays {
  alignas(64) float o[3][kLanes] = {}, d[3][kLanes] = {};  // m
  alignas(64) float reach[kLanes] = {};                    // m, or the distance of the hit
  std::uint32_t particle[kLanes];                          // kNoHit: none yet
  float entry[kLanes];                                     // m, from the ray's origin to the edge
  std::size_t ray[kLanes];
};

// kAny: whether any hit will do. Cells has
//   void strays(const Ray&, std::size_t ray, Nearest&)          what the ray finds among the strays
//   void start(Mask lanes, const LaneRays&)                     these lanes have new rays
//   void pass(Mask lanes)                                       these are in empty bricks
//   Mask meet(const Walk&, Ints slot, Mask& lanes, LaneRays&)   these are in occupied ones; returns those
//   done; takes out of `lanes` those that have more to do in their cells
//   Mask turned()                                               of those, whose rays were changed
//   void finish(int lane, const LaneRays&)                      this one is done
//   int kFewLeaps                                               so many lanes do not wait for more to leap
template <bool kAny, class Cells>
class Stream {
 public:
  Stream(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end, Cells cells)
      : grid_(grid), rays_(rays), cells_(cells), next_(begin), end_(end) {}

  FIRN_INLINE void run() {  // into its caller, so that the walk lives in registers
    Mask live = mask_of_bits(0);
    for (;;) {
      if ((waiting_ != 0 || next_ < end_) &&
          __builtin_popcount(static_cast<unsigned>(lane_bits(live))) <= kLanes - kMostIdle)
        live = take_rays(live);
      if (!any(live)) return;
      const Ints slot = gather(grid_.slot, walk_.brick(grid_), live);
      const Mask empty = live & less(slot, splat_int(0)), occupied = live & !empty;
      Mask done = mask_of_bits(0);
      const int leaping = __builtin_popcount(static_cast<unsigned>(lane_bits(empty)));
      const int walking = __builtin_popcount(static_cast<unsigned>(lane_bits(occupied)));
      // Few lanes wait until there are more of their kind.
      const bool leap = leaping >= Cells::kFewLeaps || walking == 0, walk = walking >= kFew || !leap;
      if (walk) {
        Mask leaving = occupied;
        done = cells_.meet(walk_, slot, leaving, lane_);
        done = done | walk_.step(grid_, leaving & !done, load(lane_.reach));
        if (const Mask turned = cells_.turned(); any(turned)) place(turned);
      }
      if (leap) {
        cells_.pass(empty);
        done = done | walk_.leap(grid_, empty, -slot, load(lane_.reach));
      }
      if (any(done)) {
        finish(lane_bits(done));
        live = live & !done;
      }
    }
  }

 private:
  static constexpr int kFew = kLanes * 3 / 8;
  static constexpr std::size_t kStage = 16;
  static constexpr int kMostIdle = kLanes / 4;  // lanes without a ray before the stream is asked for more

  // Gives the idle lanes rays that meet the grid; what the others find is known at once.
  FIRN_INLINE Mask take_rays(Mask live) {
    int fresh = 0;
    for (int idle = ~lane_bits(live) & kAllLanes; idle != 0; idle &= idle - 1) {
      while (waiting_ == 0 && next_ < end_) stage_rays();
      if (waiting_ == 0) break;
      const int lane = __builtin_ctz(static_cast<unsigned>(idle));
      give(__builtin_ctz(waiting_), lane);
      waiting_ &= waiting_ - 1;
      fresh |= 1 << lane;
    }
    const Mask started = mask_of_bits(fresh);
    place(started);
    cells_.start(started, lane_);
    return live | started;
  }

  FIRN_INLINE void place(Mask lanes) {
    const Floats o[3] = {load(lane_.o[0]), load(lane_.o[1]), load(lane_.o[2])},
                 d[3] = {load(lane_.d[0]), load(lane_.d[1]), load(lane_.d[2])};
    walk_.place(grid_, o, d, lanes);
  }

  // Reads the next rays of the stream and moves them to the grid's edge.
  FIRN_INLINE void stage_rays() {
    staged_ = next_;
    const std::size_t count = end_ - next_ < kStage ? end_ - next_ : kStage;
    next_ += count;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = staged_ + k;
      rays_.hit[i] = kNoHit;
      if (grid_.stray_bundles == 0) continue;
      Nearest stray{rays_.t[i], kNoHit};
      cells_.strays(load_ray(rays_, i), i, stray);
      if (stray.particle == kNoHit) continue;
      rays_.hit[i] = kAny ? 0 : stray.particle;
      if (!kAny) rays_.t[i] = stray.t;
    }
    move_to_grid(grid_, rays_, staged_, count, {stage_.o[0], stage_.o[1], stage_.o[2]},
                 {stage_.d[0], stage_.d[1], stage_.d[2]}, stage_.entry, stage_.reach);
    waiting_ = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const bool walks = stage_.reach[k] >= 0 && !(kAny && rays_.hit[staged_ + k] != kNoHit);
      waiting_ |= static_cast<unsigned>(walks) << k;
    }
  }

  FIRN_INLINE void give(int k, int lane) {
    for (int a = 0; a < 3; ++a) {
      lane_.o[a][lane] = stage_.o[a][k];
      lane_.d[a][lane] = stage_.d[a][k];
    }
    lane_.entry[lane] = stage_.entry[k];
    lane_.reach[lane] = stage_.reach[k];
    lane_.particle[lane] = kNoHit;
    lane_.ray[lane] = staged_ + static_cast<std::size_t>(k);
  }

  FIRN_INLINE void finish(int lanes) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(lanes));
      cells_.finish(lane, lane_);
      if (lane_.particle[lane] == kNoHit) continue;
      const std::size_t i = lane_.ray[lane];
      rays_.hit[i] = kAny ? 0 : lane_.particle[lane];
      if (!kAny) rays_.t[i] = lane_.entry[lane] + lane_.reach[lane];
    }
  }

  const TraceGrid& grid_;
  const RayView& rays_;
  Cells cells_;
  std::size_t next_, end_;
  // Rays that are at the grid's edge and wait for a lane.
  struct {
    float o[3][kStage], d[3][kStage], reach[kStage], entry[kStage];
  } stage_;
  std::size_t staged_ = 0;  // the stream's place of the first
  unsigned waiting_ = 0;    // a bit each
  Walk walk_ = {};
  LaneRays lane_;
};

}  // namespace firn::kernels::FIRN_ISA
