// SPDX-License-Identifier: MIT
// Coherent rays against the implicit surface of the snow, 64 or 16 at a time: as in packet.cpp the packet
// goes through the grid slice by slice along its main axis, but here each cell within its bounds that the
// surface crosses is broadcast against the rays. Its eight corners are then numbers and not gathers, and the
// fill is a polynomial of eight coefficients in the place in the cell.
//
//     +---+---+---+
//     |   |/##|###|   o--->---    A ray that begins outside meets the snow at the least distance at which
//     +---+---+---+   o--->---    any cell holds the fill of at least the level, so cells can be asked in
//     |  /|###|###|   o--->---    any order, and rounding at their faces opens no crack.
//
// Rays that begin in the snow must leave it first: they go by surface.cpp, as do those that are not coherent.
#include "kernels/trace/surface_packet.h"

namespace firn::kernels::FIRN_ISA {

void surface_closest(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);
void surface_occluded(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);

constexpr int kSecants = 3;

// fill - level in a cell whose sides are 1, as a polynomial.
struct CellFill {
  Floats k[8];  // of 1, z, y, yz, x, xz, xy, xyz

  FIRN_INLINE CellFill(const float* corner, float level) {
    float c[8];
    for (int i = 0; i < 8; ++i)
      c[i] = corner[(i >> 2) * kCornerSide * kCornerSide + (i >> 1 & 1) * kCornerSide + (i & 1)] - level;
    for (int bit = 1; bit < 8; bit *= 2) {
      for (int i = 0; i < 8; ++i) c[i] = i & bit ? c[i] - c[i ^ bit] : c[i];
    }
    for (int i = 0; i < 8; ++i) k[i] = splat(c[i]);
  }
  FIRN_INLINE Floats at(const Floats u[3]) const {
    const Floats flat = fma(u[1], fma(u[2], k[3], k[2]), fma(u[2], k[1], k[0]));
    const Floats slope = fma(u[1], fma(u[2], k[7], k[6]), fma(u[2], k[5], k[4]));
    return fma(u[0], slope, flat);
  }
};

template <int kRays, bool kAny>
FIRN_INLINE void SurfacePacket<kRays, kAny>::note(int part, Mask hit, Floats t, Ints what) {
  best_[part] = select(hit, kAny ? splat(-1) : t, best_[part]);
  particle_[part] = select(hit, kAny ? splat_int(0) : what, particle_[part]);
}

// Lanes that are in the snow where they come into the cell or rise into it before `end`, and where (t).
template <int kRays, bool kAny>
FIRN_INLINE Mask SurfacePacket<kRays, kAny>::rise(int part, const CellFill& fill, const Floats from[3],
                                                  Mask lanes, Floats begin, Floats end, Floats& t) const {
  const auto value = [&](Floats at) FIRN_INLINE_LAMBDA {
    Floats u[3];
    for (int a = 0; a < 3; ++a)
      u[a] = min(max(fma(at, d_[a][part] * grid_.inv_cell, from[a]), splat(0)), splat(1));
    return fill.at(u);
  };
  Floats t0 = begin, g0 = value(begin), ta = begin, ga = g0, tb = begin, gb = g0;
  Mask hit = lanes & less_equal(splat(0), g0);
  const Mask crack = hit;
  for (int k = 1; k <= 3; ++k) {
    const Floats t1 = k == 3 ? end : fma(splat(static_cast<float>(k) / 3), end - begin, begin);
    const Floats g1 = value(t1);
    const Mask rises = lanes & !hit & less(g0, splat(0)) & !less(g1, splat(0));
    ta = select(rises, t0, ta), ga = select(rises, g0, ga);
    tb = select(rises, t1, tb), gb = select(rises, g1, gb);
    hit = hit | rises;
    t0 = t1, g0 = g1;
  }
  if (kAny || !any(hit & !crack)) {
    t = begin;
    return hit;
  }
  Floats at = begin;
  for (int k = 0; k < kSecants; ++k) {
    const Floats share = min(max(ga / (ga - gb), splat(0)), splat(1));
    at = fma(share, tb - ta, ta);
    if (k + 1 == kSecants) break;
    const Floats g = value(at);
    const Mask low = less(g, splat(0));
    ta = select(low, at, ta), ga = select(low, g, ga);
    tb = select(low, tb, at), gb = select(low, gb, g);
  }
  t = select(crack, begin, at);
  return hit;
}

template <int kRays, bool kAny>
FIRN_INLINE void SurfacePacket<kRays, kAny>::test_surface(std::int32_t slot, const int cell[3],
                                                          bool crossed) {
  float low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    low[a] = static_cast<float>(cell[a]) * grid_.cell;
    high[a] = static_cast<float>(cell[a] + 1) * grid_.cell;
  }
  const CellFill fill(field_.fill + static_cast<std::size_t>(slot) * kBrickCorners +
                          ((cell[0] & 3) * kCornerSide + (cell[1] & 3)) * kCornerSide + (cell[2] & 3),
                      field_.level);
  for (int part = 0; part < kParts; ++part) {
    Floats begin = splat(0), end = best_[part];
    for (int a = 0; a < 3; ++a) {
      const Floats first = (low[a] - o_[a][part]) * inv_[a][part];
      const Floats second = (high[a] - o_[a][part]) * inv_[a][part];
      begin = max(begin, min(first, second));
      end = min(end, max(first, second));
    }
    const Mask lanes = live(part) & less_equal(begin, end);
    if (!any(lanes)) continue;
    Floats t = begin;
    Mask hit = lanes;
    if (crossed) {
      Floats from[3];
      for (int a = 0; a < 3; ++a) from[a] = o_[a][part] * grid_.inv_cell - static_cast<float>(cell[a]);
      hit = rise(part, fill, from, lanes, begin, end, t);
    }
    if (!any(hit)) continue;
    found_ = true;
    note(part, hit, t, splat_int(static_cast<std::int32_t>(kSurfaceHit)));
  }
}

// False where the cell has no list.
template <int kRays, bool kAny>
FIRN_INLINE bool SurfacePacket<kRays, kAny>::test_loose(std::size_t place, const int cell[3]) {
  std::uint32_t word = __atomic_load_n(&grid_.list[place], __ATOMIC_ACQUIRE);
  if (word == kUnlisted) word = make_list(grid_, place, cell);
  if (word == kNoList) return false;
  const std::size_t count = word & kMostListed;
  const float* list = grid_.lists + static_cast<std::size_t>(word >> 8) * kListUnit;
  for (std::size_t i = 0; i < count; ++i) {
    const Floats r2 =
        splat(grid_.radius != nullptr ? list[4 * count + i] : grid_.max_radius * grid_.max_radius);
    std::int32_t index;
    __builtin_memcpy(&index, list + 3 * count + i, sizeof index);
    for (int part = 0; part < kParts; ++part) {
      const Floats c[3] = {list[i] - o_[0][part], list[count + i] - o_[1][part],
                           list[2 * count + i] - o_[2][part]};
      const Floats d[3] = {d_[0][part], d_[1][part], d_[2][part]};
      Floats along;
      const Floats depth2 = project(c, d, r2, along);
      if (!any(less_equal(splat(0), depth2))) continue;
      const Floats t = along - sqrt(depth2);  // NaN where missed: every comparison is then false
      // Flipping the sign bit orders unsigned indices as signed ones.
      const Mask lower = less(splat_int(index) ^ INT32_MIN, particle_[part] ^ INT32_MIN);
      const Mask nearer = less(splat(0), t) & (less(t, best_[part]) | (less_equal(t, best_[part]) & lower));
      if (any(nearer)) found_ = true;
      note(part, nearer, t, splat_int(index));
    }
  }
  return true;
}

template <int kRays, bool kAny>
bool SurfacePacket<kRays, kAny>::test_cells(const int low[3], const int high[3]) {
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const std::int32_t slot = grid_.slot[brick_at(grid_, x >> 2, y >> 2, z >> 2)];
        if (slot < 0) {
          z |= 3;
          continue;
        }
        const int cell[3] = {x, y, z};
        const std::size_t place = cell_at(slot, x, y, z);
        const std::uint32_t bits = field_.cell_kind[place >> 3] >> (4 * (place & 7));
        if ((bits & kHasLoose) != 0 && !test_loose(place, cell)) return false;
        if ((bits & 3) != kOutside) test_surface(slot, cell, (bits & 3) == kCrossed);
      }
    }
  }
  return true;
}

// Slab of bricks after slab of bricks, slice after slice. "Along" counts in the rays' direction.
template <int kRays, bool kAny>
bool SurfacePacket<kRays, kAny>::walk(float widest) {
  const float most = widest * grid_.cell;
  const int cells = grid_.cells[main_];
  const auto plane = [&](int k) { return static_cast<float>(forward_ ? k : k - cells) * grid_.cell; };
  const float begin = from_ - margin_ - plane(0);
  const int first = begin > 0 ? static_cast<int>(begin * grid_.inv_cell) : 0;
  float steepest = 1;
  for (int side = 0; side < 2; ++side) {
    const float low = __builtin_fabsf(slope_.low[side]), high = __builtin_fabsf(slope_.high[side]);
    steepest = low > steepest ? low : steepest;
    steepest = high > steepest ? high : steepest;
  }
  for (int slab = first & ~3; slab < cells; slab += kBrickCells) {
    if (plane(slab) - margin_ > furthest_) return true;
    int low[3], high[3];
    const auto slices = [&](int k, int count, int& first_cell, int& last_cell) {
      first_cell = forward_ ? k : cells - k - count;
      last_cell = first_cell + count - 1;
    };
    int least, last;
    slices(slab, kBrickCells, least, last);
    if (!cells_of(window(plane(slab) - margin_, plane(slab + kBrickCells) + margin_), least, last, low, high))
      continue;
    if (const int empty = clearance(low, high); empty > 0) {
      // Every brick nearer than `empty` is empty, and the rays go aside by their slope at most.
      slab += kBrickCells * static_cast<int>(static_cast<float>(empty - 1) / steepest);
      continue;
    }
    bool look_ahead_needed = false;
    for (int k = slab > first ? slab : first; k < slab + kBrickCells; ++k) {
      if (plane(k) - margin_ > furthest_) return true;
      slices(k, 1, least, last);
      const Window here = window(plane(k) - margin_, plane(k + 1) + margin_);
      if (!cells_of(here, least, last, low, high)) continue;
      if (here.high[0] - here.low[0] > most || here.high[1] - here.low[1] > most) return false;
      found_ = false;
      if (!test_cells(low, high)) return false;
      if (found_) {
        look_ahead_needed = true;
        shorten();
      }
    }
    if (look_ahead_needed) look_ahead(plane(slab + kBrickCells) - margin_);
  }
  return true;
}

template <int kRays, bool kAny>
void SurfacePacket<kRays, kAny>::store_hits() const {
  float best[kRays];
  std::int32_t particle[kRays];
  for (int part = 0; part < kParts; ++part) {
    store(best + part * kLanes, best_[part]);
    store(particle + part * kLanes, particle_[part]);
  }
  for (int lane = 0; lane < kRays; ++lane) {
    if (particle[lane] == -1) continue;
    if (!kAny) rays_.t[begin_ + lane] = static_cast<float>(entry_[lane] + best[lane]);
    rays_.hit[begin_ + lane] = static_cast<std::uint32_t>(particle[lane]);
  }
}

template <int kRays, bool kAny>
void SurfacePacket<kRays, kAny>::trace_others() const {
  for (std::uint64_t left = inside_; left != 0; left &= left - 1) {
    const std::size_t i = begin_ + static_cast<std::size_t>(__builtin_ctzll(left));
    (kAny ? surface_occluded : surface_closest)(grid_, field_, rays_, i, i + 1);
  }
}

namespace {

constexpr int kLarge = 64, kSmall = 16;  // rays

// False if the packet is too wide or not coherent; nothing is found then (a stray that shortened a ray is
// found again: it lies within the reach).
template <int kRays, bool kAny>
bool trace_packet(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin,
                  float widest) {
  SurfacePacket<kRays, kAny> packet(grid, field, rays, begin);
  if (packet.load_rays()) {
    if (!packet.choose_main() || !packet.walk(widest)) return false;
    packet.store_hits();
  }
  packet.trace_others();
  return true;
}

// Cells across a packet beyond which fewer rays at a time are faster; from the bench.
constexpr float kWidestLarge = 6, kWidestSmall = 4;

template <bool kAny>
void trace_coherent(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin,
                    std::size_t end) {
  const auto one_by_one = kAny ? surface_occluded : surface_closest;
  for (; begin + kSmall <= end;) {
    const bool large = begin + kLarge <= end;
    if (large && trace_packet<kLarge, kAny>(grid, field, rays, begin, kWidestLarge)) {
      begin += kLarge;
      continue;
    }
    for (const std::size_t last = begin + (large ? kLarge : kSmall); begin < last; begin += kSmall) {
      if (!trace_packet<kSmall, kAny>(grid, field, rays, begin, kWidestSmall))
        one_by_one(grid, field, rays, begin, begin + kSmall);
    }
  }
  one_by_one(grid, field, rays, begin, end);
}

}  // namespace

void surface_closest_coherent(const TraceGrid& grid, const SurfaceField& field, const RayView& rays,
                              std::size_t begin, std::size_t end) {
  trace_coherent<false>(grid, field, rays, begin, end);
}
void surface_occluded_coherent(const TraceGrid& grid, const SurfaceField& field, const RayView& rays,
                               std::size_t begin, std::size_t end) {
  trace_coherent<true>(grid, field, rays, begin, end);
}

}  // namespace firn::kernels::FIRN_ISA
