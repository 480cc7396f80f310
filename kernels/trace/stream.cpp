// SPDX-License-Identifier: MIT
// Incoherent rays: a register of them walks the grid in lock step, each lane in a cell of its own (leaping
// through empty bricks by their clearance), and a lane whose cell holds balls tests them, a register at a
// time. Lanes whose rays are done take the next rays of the stream. In: grid, rays. Out: distance and
// particle per ray. A ray from outside is first moved to the grid's edge in double, so that a far camera
// costs no precision.
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr std::size_t kStage = 16;
constexpr int kMostIdle = kLanes / 4;  // lanes without a ray before the stream is asked for more

template <bool kAny>
class Stream {
 public:
  Stream(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end)
      : grid_(grid), rays_(rays), next_(begin), end_(end) {}

  void run() {
    Mask live = mask_of_bits(0);
    for (;;) {
      if ((waiting_ != 0 || next_ < end_) &&
          __builtin_popcount(static_cast<unsigned>(lane_bits(live))) <= kLanes - kMostIdle)
        live = take_rays(live);
      if (!any(live)) return;
      const Ints slot = gather(grid_.slot, walk_.brick(grid_), live);
      const Mask empty = live & less(slot, splat_int(0)), occupied = live & !empty;
      Mask done = mask_of_bits(0);
      if (any(occupied)) {
        done = test_cells(slot, occupied);
        done = done | walk_.step(grid_, occupied & !done, load(reach_));
      }
      if (any(empty)) done = done | walk_.leap(grid_, empty, -slot, load(reach_));
      if (any(done)) {
        finish(lane_bits(done));
        live = live & !done;
      }
    }
  }

 private:
  // Gives the idle lanes rays that meet the grid; what the others find is known at once.
  Mask take_rays(Mask live) {
    int fresh = 0;
    for (int idle = ~lane_bits(live) & kAllLanes; idle != 0; idle &= idle - 1) {
      while (waiting_ == 0 && next_ < end_) stage_rays();
      if (waiting_ == 0) break;
      const int lane = __builtin_ctz(static_cast<unsigned>(idle));
      give(__builtin_ctz(waiting_), lane);
      waiting_ &= waiting_ - 1;
      fresh |= 1 << lane;
    }
    const Floats o[3] = {load(o_[0]), load(o_[1]), load(o_[2])},
                 d[3] = {load(d_[0]), load(d_[1]), load(d_[2])};
    walk_.place(grid_, o, d, mask_of_bits(fresh));
    return live | mask_of_bits(fresh);
  }

  // Reads the next rays of the stream and moves them to the grid's edge.
  void stage_rays() {
    staged_ = next_;
    const std::size_t count = end_ - next_ < kStage ? end_ - next_ : kStage;
    next_ += count;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = staged_ + k;
      rays_.hit[i] = kNoHit;
      if (grid_.stray_bundles == 0) continue;
      Nearest stray{rays_.t[i], kNoHit};
      test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, i), stray);
      if (stray.particle == kNoHit) continue;
      rays_.hit[i] = kAny ? 0 : stray.particle;
      if (!kAny) rays_.t[i] = stray.t;
    }
    for (std::size_t k = 0; k < count; ++k) {
      const Ray ray = load_ray(rays_, staged_ + k);
      float moved[3];
      enter_grid(grid_, ray.o, ray.d, rays_.t[staged_ + k], moved, stage_.entry[k], stage_.reach[k]);
      for (int a = 0; a < 3; ++a) {
        stage_.o[a][k] = moved[a];
        stage_.d[a][k] = ray.d[a];
      }
    }
    waiting_ = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const bool walks = stage_.reach[k] >= 0 && !(kAny && rays_.hit[staged_ + k] != kNoHit);
      waiting_ |= static_cast<unsigned>(walks) << k;
    }
  }

  void give(int k, int lane) {
    for (int a = 0; a < 3; ++a) {
      o_[a][lane] = stage_.o[a][k];
      d_[a][lane] = stage_.d[a][k];
    }
    entry_[lane] = stage_.entry[k];
    reach_[lane] = stage_.reach[k];
    particle_[lane] = kNoHit;
    ray_[lane] = staged_ + static_cast<std::size_t>(k);
  }

  // Tests the balls of the lanes' cells. Returns the lanes that need look no further.
  Mask test_cells(Ints slot, Mask lanes) {
    const Ints place = walk_.cell_in(slot);
    const Ints word = gather(reinterpret_cast<const std::int32_t*>(grid_.list), place, lanes);
    const int listed = lane_bits(lanes & !equal(word, splat_int(0)));
    if (listed == 0) return mask_of_bits(0);
    std::int32_t places[kLanes], cell[3][kLanes];
    store(places, place);
    for (int a = 0; a < 3; ++a) store(cell[a], walk_.cell(a));
    int done = 0;
    for (int left = listed; left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(left));
      const Ray ray{{o_[0][lane], o_[1][lane], o_[2][lane]}, {d_[0][lane], d_[1][lane], d_[2][lane]}};
      const int at[3] = {cell[0][lane], cell[1][lane], cell[2][lane]};
      Nearest best{reach_[lane], particle_[lane]};
      test_cell<kAny>(grid_, static_cast<std::size_t>(places[lane]), at, ray, best);
      reach_[lane] = best.t;
      particle_[lane] = best.particle;
      if (kAny && best.particle != kNoHit) done |= 1 << lane;
    }
    return mask_of_bits(done);
  }

  void finish(int lanes) {
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(lanes));
      if (particle_[lane] == kNoHit) continue;
      rays_.hit[ray_[lane]] = kAny ? 0 : particle_[lane];
      if (!kAny) rays_.t[ray_[lane]] = static_cast<float>(entry_[lane] + reach_[lane]);
    }
  }

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t next_, end_;
  // Rays that are at the grid's edge and wait for a lane.
  struct {
    float o[3][kStage], d[3][kStage], reach[kStage];
    double entry[kStage];
  } stage_;
  std::size_t staged_ = 0;  // the stream's place of the first
  unsigned waiting_ = 0;    // a bit each
  Walk walk_ = {};
  alignas(64) float o_[3][kLanes] = {}, d_[3][kLanes] = {}, reach_[kLanes] = {};
  double entry_[kLanes];
  std::uint32_t particle_[kLanes];
  std::size_t ray_[kLanes];
};

}  // namespace

void closest(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Stream<false>(grid, rays, begin, end).run();
}

void occluded(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Stream<true>(grid, rays, begin, end).run();
}

}  // namespace firn::kernels::FIRN_ISA
