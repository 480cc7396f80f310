// SPDX-License-Identifier: MIT
// Incoherent rays against balls: a lane whose cell holds balls tests them, a register at a time.
#include "kernels/trace/stream.h"

#include "kernels/trace/cell_list.h"

namespace firn::kernels::FIRN_ISA {
namespace {

template <bool kAny>
struct BallCells {
  const TraceGrid& grid;

  void start(Mask) {}
  void pass(Mask) {}
  FIRN_INLINE Mask meet(const Walk& walk, Ints slot, Mask lanes, LaneRays& rays) {
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

}  // namespace

void closest(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Stream<false, BallCells<false>>(grid, rays, begin, end, {grid}).run();
}

void occluded(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Stream<true, BallCells<true>>(grid, rays, begin, end, {grid}).run();
}

}  // namespace firn::kernels::FIRN_ISA
