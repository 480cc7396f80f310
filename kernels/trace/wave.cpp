// SPDX-License-Identifier: MIT
// Incoherent rays against balls, some hundred at a time, in waves: all rays of a wave take a step together.
//
//     where each stands -> lists of those that stand in cells with balls -> registers of balls that a ray may
//     enter -> what it enters; then each goes on to its next cell, or leaps out of empty bricks.
//
// Each of these is one loop over all, so that few branches are taken by surprise, and what one ray waits for
// holds up no other: a single register of rays in lock step took twice as long. When a quarter of the places
// are empty, the rest close ranks, and when half of the room is free, new rays follow. A ray from outside is
// first moved to the grid's edge.
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {
namespace {

// kAny: whether any hit will do.
template <bool kAny>
class Wave {
 public:
  static constexpr std::size_t kMost = 512;  // rays

  Wave(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end)
      : grid_(grid), rays_(rays), begin_(begin), next_(begin), end_(end) {}

  void trace() {
    while (alive_ > 0 || next_ < end_) {
      if (4 * alive_ <= 3 * kLanes * registers_) close_ranks();
      if (next_ < end_ && 2 * registers_ <= kMostRegisters) take();
      const int listed = find_listed();
      test_lists(listed);
      go_on();
    }
  }

 private:
  static constexpr int kMostRegisters = kMost / kLanes;
  static constexpr int kMostFound = 64;  // registers of balls at a time
  static constexpr int kAhead = 4;       // lists asked for before they are read

  void take();
  void close_ranks();
  int find_listed();
  void test_lists(int listed);
  FIRN_INLINE void fetch(std::uint32_t word) const;
  FIRN_INLINE void test_list(std::uint32_t word, int at);
  void enter_found();
  FIRN_INLINE void enter(Floats t, int bits, int k);
  FIRN_INLINE void block(int at, bool blocked);
  void test_around(int at, const int cell[3]);
  void go_on();

  const TraceGrid& grid_;
  const RayView& rays_;
  std::size_t begin_, next_, end_;  // rays; from next_ on they are still to come
  int registers_ = 0, alive_ = 0;   // in use; rays
  // By place in the wave.
  alignas(64) float o_[3][kMost], d_[3][kMost], inv_[3][kMost];  // m, unit, and one over it
  alignas(64) float reach_[kMost];                               // m; negative: done
  alignas(64) float entry_[kMost];                               // m, from the ray's origin to the grid
  alignas(64) std::int32_t cell_[3][kMost], slot_[kMost];
  alignas(64) std::int32_t ray_[kMost];  // from begin_ on
  int live_[kMostRegisters];             // bits
  // Rays that stand in cells with balls: their places, and the cells' words.
  std::int32_t listed_[kMost + kLanes], word_[kMost + kLanes];
  // Registers of balls that a ray may enter: which, whose place, and where their indices are.
  float along_[kMostFound][kLanes], depth2_[kMostFound][kLanes];  // m, m^2
  int bits_[kMostFound], whose_[kMostFound];
  const float* index_[kMostFound];
  int found_ = 0;
};

// The next rays, as many as there is room for. What strays have is found here; then the rays are moved to the
// grid's edge.
template <bool kAny>
void Wave<kAny>::take() {
  const std::size_t at = static_cast<std::size_t>(registers_) * kLanes, begin = next_;
  const std::size_t count = end_ - begin < kMost - at ? end_ - begin : kMost - at;
  next_ += count;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = begin + k;
    rays_.hit[i] = kNoHit;
    if (grid_.stray_bundles == 0) continue;
    Nearest stray{rays_.t[i], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, i), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[i] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[i] = stray.t;
  }
  move_to_grid(grid_, rays_, begin, count, {o_[0] + at, o_[1] + at, o_[2] + at},
               {d_[0] + at, d_[1] + at, d_[2] + at}, entry_ + at, reach_ + at);
  for (std::size_t k = 0; kAny && k < count; ++k) {
    if (rays_.hit[begin + k] != kNoHit) reach_[at + k] = -1;
  }
  const int first = registers_;
  registers_ += static_cast<int>((count + kLanes - 1) / kLanes);
  for (std::size_t k = at + count; k < static_cast<std::size_t>(registers_) * kLanes; ++k) reach_[k] = -1;
  for (int r = first; r < registers_; ++r) {
    const int k = r * kLanes;
    live_[r] = lane_bits(less_equal(splat(0), load(reach_ + k)));
    alive_ += __builtin_popcount(static_cast<unsigned>(live_[r]));
    store(ray_ + k, lane_numbers() + static_cast<std::int32_t>(begin - begin_ + k - at));
    for (int a = 0; a < 3; ++a) {
      store(inv_[a] + k, inverse_of(load(d_[a] + k)));
      store(cell_[a] + k, cell_of(grid_, a, load(o_[a] + k)));
    }
  }
}

template <bool kAny>
void Wave<kAny>::close_ranks() {
  int next = 0;
  for (int r = 0; r < registers_; ++r) {
    const Mask live = mask_of_bits(live_[r]);
    const int k = r * kLanes;
    for (int a = 0; a < 3; ++a) {
      store_packed(o_[a] + next, live, load(o_[a] + k));
      store_packed(d_[a] + next, live, load(d_[a] + k));
      store_packed(inv_[a] + next, live, load(inv_[a] + k));
      store_packed(cell_[a] + next, live, load(cell_[a] + k));
    }
    store_packed(reach_ + next, live, load(reach_ + k));
    store_packed(entry_ + next, live, load(entry_ + k));
    store_packed(ray_ + next, live, load(ray_ + k));
    next += __builtin_popcount(static_cast<unsigned>(live_[r]));
  }
  registers_ = (next + kLanes - 1) / kLanes;
  for (int r = 0; r < registers_; ++r) {
    const int rest = next - r * kLanes;
    live_[r] = rest < kLanes ? (1 << rest) - 1 : kAllLanes;
  }
}

// The result: how many rays stand in cells with balls.
template <bool kAny>
int Wave<kAny>::find_listed() {
  int count = 0;
  for (int r = 0; r < registers_; ++r) {
    const int k = r * kLanes;
    const Mask live = mask_of_bits(live_[r]);
    const Ints c[3] = {load(cell_[0] + k), load(cell_[1] + k), load(cell_[2] + k)};
    const Ints brick = ((c[0] >> 2) * grid_.bricks[1] + (c[1] >> 2)) * grid_.bricks[2] + (c[2] >> 2);
    const Ints slot = gather(grid_.slot, brick, live);
    const Ints place = slot * kCellsPerBrick + (((c[0] & 3) << 4) + ((c[1] & 3) << 2) + (c[2] & 3));
    const Mask occupied = live & !less(slot, splat_int(0));
    const Ints word = gather(reinterpret_cast<const std::int32_t*>(grid_.list), place, occupied);
    const Mask listed = occupied & !equal(word, splat_int(0));
    store(slot_ + k, slot);
    store_packed(listed_ + count, listed, lane_numbers() + k);
    store_packed(word_ + count, listed, word);
    count += __builtin_popcount(static_cast<unsigned>(lane_bits(listed)));
  }
  return count;
}

template <bool kAny>
void Wave<kAny>::test_lists(int listed) {
  for (int i = 0; i < listed; ++i) {
    const int at = listed_[i];
    fetch(static_cast<std::uint32_t>(word_[i + kAhead < listed ? i + kAhead : i]));
    auto word = static_cast<std::uint32_t>(word_[i]);
    if (word >= kNoList) {
      const int cell[3] = {cell_[0][at], cell_[1][at], cell_[2][at]};
      word = find_list(grid_, cell_at(slot_[at], cell[0], cell[1], cell[2]), cell);
      if (word == kNoList) {
        test_around(at, cell);
        continue;
      }
    }
    test_list(word, at);
  }
  enter_found();
}

// Asks for a list that will soon be read.
template <bool kAny>
FIRN_INLINE void Wave<kAny>::fetch(std::uint32_t word) const {
  if (word >= kNoList) return;
  const float* const list = grid_.lists + static_cast<std::size_t>(word >> 8) * kListUnit;
  for (int unit = 0; unit < 4; ++unit) __builtin_prefetch(list + unit * kListUnit);
}

template <bool kAny>
FIRN_INLINE void Wave<kAny>::test_list(std::uint32_t word, int at) {
  const int count = static_cast<int>(word & kMostListed);
  const float* const list = grid_.lists + static_cast<std::size_t>(word >> 8) * kListUnit;
  const Floats r2 = splat(grid_.max_radius * grid_.max_radius);
  for (int i = 0; i < count; i += kLanes) {
    const int some = count - i < kLanes ? count - i : kLanes;
    const auto column = [&](int k) FIRN_INLINE_LAMBDA { return load_first(list + k * count + i, some, 0.f); };
    const Floats c[3] = {column(0) - o_[0][at], column(1) - o_[1][at], column(2) - o_[2][at]};
    const Floats d[3] = {splat(d_[0][at]), splat(d_[1][at]), splat(d_[2][at])};
    const Floats its = grid_.radius == nullptr ? r2 : column(4);
    Floats along;
    const Floats depth2 = project(c, d, its, along);
    if (kAny) {
      block(at, any(blocks(depth2, along, splat(reach_[at])) & mask_of_first(some)));
      continue;
    }
    store(along_[found_], along);
    store(depth2_[found_], depth2);
    bits_[found_] =
        lane_bits(may_enter(depth2, along, splat(grid_.max_radius), splat(reach_[at])) & mask_of_first(some));
    whose_[found_] = at;
    index_[found_] = list + 3 * count + i;
    found_ += bits_[found_] != 0;
    if (found_ == kMostFound) enter_found();
  }
}

template <bool kAny>
void Wave<kAny>::enter_found() {
  for (int k = 0; k < found_; ++k) enter(load(along_[k]) - sqrt(load(depth2_[k])), bits_[k], k);
  found_ = 0;
}

// t: of the balls in `bits`. The nearest of them, if it is nearer than what the ray has found.
template <bool kAny>
FIRN_INLINE void Wave<kAny>::enter(Floats t, int bits, int k) {
  const int at = whose_[k];
  const std::size_t i = begin_ + static_cast<std::size_t>(ray_[at]);
  const float reach = reach_[at];
  int in = lane_bits(less(splat(0), t) & less_equal(t, splat(reach))) & bits;
  if (in == 0) return;
  const Floats distance = select(mask_of_bits(in), t, splat(__builtin_huge_valf()));
  const float least = -greatest_lane(-distance);
  std::uint32_t first = kNoHit;  // of equal distances the lowest index
  for (in &= lane_bits(less_equal(distance, splat(least))); in != 0; in &= in - 1) {
    std::uint32_t particle;
    __builtin_memcpy(&particle, index_[k] + __builtin_ctz(static_cast<unsigned>(in)), sizeof particle);
    first = particle < first ? particle : first;
  }
  if (least == reach && rays_.hit[i] < first) return;
  reach_[at] = least;
  rays_.hit[i] = first;
  rays_.t[i] = entry_[at] + least;
}

template <bool kAny>
FIRN_INLINE void Wave<kAny>::block(int at, bool blocked) {
  const std::size_t i = begin_ + static_cast<std::size_t>(ray_[at]);
  rays_.hit[i] = blocked ? 0 : rays_.hit[i];
  reach_[at] = blocked ? -1 : reach_[at];
}

// Where there is no list.
template <bool kAny>
void Wave<kAny>::test_around(int at, const int cell[3]) {
  const Ray ray{{o_[0][at], o_[1][at], o_[2][at]}, {d_[0][at], d_[1][at], d_[2][at]}};
  const std::size_t i = begin_ + static_cast<std::size_t>(ray_[at]);
  Nearest best{reach_[at], rays_.hit[i]};
  for_each_run_around(grid_, cell, cells_reached(grid_), [&](std::uint32_t begin, std::uint32_t end) {
    if (kAny) {
      block(at, run_blocks(grid_, begin, end, ray, reach_[at]));
    } else {
      test_run(grid_, begin, end, ray, best);
    }
  });
  if (kAny || best.particle == rays_.hit[i]) return;
  reach_[at] = best.t;
  rays_.hit[i] = best.particle;
  rays_.t[i] = entry_[at] + best.t;
}

// Each to its next cell.
template <bool kAny>
void Wave<kAny>::go_on() {
  alive_ = 0;
  for (int r = 0; r < registers_; ++r) {
    const int k = r * kLanes;
    const Ints slot = load(slot_ + k);
    const Mask empty = less(slot, splat_int(0));
    Ints cell[3], low[3], high[3];
    Floats o[3], d[3], inv[3], t;
    for (int a = 0; a < 3; ++a) {
      o[a] = load(o_[a] + k);
      d[a] = load(d_[a] + k);
      inv[a] = load(inv_[a] + k);
      cell[a] = load(cell_[a] + k);
      cube_around(cell[a], -slot, low[a], high[a]);
      low[a] = select(empty, low[a], cell[a]);
      high[a] = select(empty, high[a], cell[a] + 1);
    }
    live_[r] &= ~lane_bits(leave_cube(grid_, o, d, inv, low, high, load(reach_ + k), cell, t));
    for (int a = 0; a < 3; ++a) store(cell_[a] + k, cell[a]);
    alive_ += __builtin_popcount(static_cast<unsigned>(live_[r]));
  }
}

}  // namespace

void closest(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Wave<false>(grid, rays, begin, end).trace();
}

void occluded(const TraceGrid& grid, const RayView& rays, std::size_t begin, std::size_t end) {
  Wave<true>(grid, rays, begin, end).trace();
}

}  // namespace firn::kernels::FIRN_ISA
