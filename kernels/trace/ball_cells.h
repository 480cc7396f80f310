// SPDX-License-Identifier: MIT
// Balls as what a cell holds for a Stream: a lane whose cell is listed tests its balls, a register at a time.
#pragma once
#include "kernels/trace/cell_list.h"
#include "kernels/trace/stream.h"

namespace firn::kernels::FIRN_ISA {

template <bool kAny>
struct BallCells {
  static constexpr int kFewLeaps = kLanes * 3 / 8;
  const TraceGrid& grid;

  FIRN_INLINE void strays(const Ray& ray, std::size_t, Nearest& best) const {
    test_bundles<kAny>(grid.strays, 0, grid.stray_bundles, ray, best);
  }
  void start(Mask, const LaneRays&) {}
  void pass(Mask) {}
  Mask turned() const { return mask_of_bits(0); }
  void finish(int, const LaneRays&) {}
  FIRN_INLINE Mask meet(const Walk& walk, Ints slot, const Mask& lanes, LaneRays& rays) {
    const Ints place = walk.cell_in(slot);
    const Ints word = gather(reinterpret_cast<const std::int32_t*>(grid.list), place, lanes);
    const int listed = lane_bits(lanes & !equal(word, splat_int(0)));
    if (listed == 0) return mask_of_bits(0);
    std::int32_t places[kLanes], cell[3][kLanes];
    store(places, place);
    for (int a = 0; a < 3; ++a) store(cell[a], walk.cell(a));
    int done = 0;
    for (int left = listed; left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(left));
      const Ray ray{{rays.o[0][lane], rays.o[1][lane], rays.o[2][lane]},
                    {rays.d[0][lane], rays.d[1][lane], rays.d[2][lane]}};
      const int at[3] = {cell[0][lane], cell[1][lane], cell[2][lane]};
      Nearest best{rays.reach[lane], rays.particle[lane]};
      test_cell<kAny>(grid, static_cast<std::size_t>(places[lane]), at, ray, best);
      rays.reach[lane] = best.t;
      rays.particle[lane] = best.particle;
      if (kAny && best.particle != kNoHit) done |= 1 << lane;
    }
    return mask_of_bits(done);
  }
};

}  // namespace firn::kernels::FIRN_ISA
