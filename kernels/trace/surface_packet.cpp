// SPDX-License-Identifier: MIT
// Packets of rays against the implicit surface of the snow: slice after slice, each cell within the packet's
// bounds that the surface crosses is broadcast against the rays. Its eight corners are then numbers and not
// gathers, and the fill is a polynomial of eight coefficients in the place in the cell.
//
//     +---+---+---+
//     |   |/##|###|   o--->---    A ray that begins outside meets the snow at the least distance at which
//     +---+---+---+   o--->---    any cell holds the fill of at least the level, so cells can be asked in
//     |  /|###|###|   o--->---    any order, and rounding at their faces opens no crack.
//
// Rays that begin in the snow must leave it first: they go by surface.cpp, as do those that are not coherent.
#include "kernels/trace/corners.h"
#include "kernels/trace/packet.h"

namespace firn::kernels::FIRN_ISA {

void surface_closest(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);
void surface_occluded(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);

namespace {

constexpr int kSecants = 3;
constexpr float kFlat = 1e-20f;  // of a direction

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

template <bool kAny>
class SurfacePacket : public Packet<SurfacePacket<kAny>, kAny> {
  using Base = Packet<SurfacePacket<kAny>, kAny>;

 public:
  SurfacePacket(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin)
      : Base(grid, rays, begin, kCellMargin * grid.cell), field_(field) {}

  // The rays that begin in the snow.
  void trace_others() const;

 private:
  friend Base;
  static constexpr float kWidest = 5;
  using Base::begin_, Base::best_, Base::d_, Base::entry_, Base::first_, Base::found_, Base::furthest_,
      Base::grid_, Base::kParts, Base::live, Base::o_, Base::particle_, Base::rays_, Base::reach_;

  void set_aside();
  FIRN_INLINE Mask begins_inside(int part, Mask lanes) const;
  Slab meet(int slab, const CellRange& cells);
  bool test_cells(const CellRange& cells);
  FIRN_INLINE bool test_loose(std::size_t place, const int cell[3]);
  FIRN_INLINE void test_surface(std::int32_t slot, const int cell[3], bool crossed);
  FIRN_INLINE Mask rise(int part, const CellFill& fill, const Floats from[3], Mask lanes, Floats begin,
                        Floats end, Floats& t) const;
  FIRN_INLINE void note(int part, Mask hit, Floats t, std::uint32_t what);

  const SurfaceField& field_;
  Floats inv_[3][kParts];     // of the directions
  std::uint64_t inside_ = 0;  // rays that begin in the snow, a bit each
};

template <bool kAny>
void SurfacePacket<kAny>::set_aside() {
  for (int part = 0; part < kParts; ++part) {
    for (int a = 0; a < 3; ++a) {
      const Mask flat = less(abs(d_[a][part]), splat(kFlat));
      inv_[a][part] = select(flat, copy_sign(splat(1 / kFlat), d_[a][part]), 1 / d_[a][part]);
    }
    const Mask here = live(part) & less_equal(entry_[part], splat(0));  // begins in the grid
    if (!any(here)) continue;
    const Mask inside = begins_inside(part, here);
    inside_ |= static_cast<std::uint64_t>(lane_bits(inside)) << (part * kLanes);
    best_[part] = select(inside, splat(-1), best_[part]);
  }
}

template <bool kAny>
FIRN_INLINE Mask SurfacePacket<kAny>::begins_inside(int part, Mask lanes) const {
  const Floats o[3] = {o_[0][part], o_[1][part], o_[2][part]};
  const CellPoints points(grid_, o, lanes);
  if (!any(points.inside)) return points.inside;
  const Floats fill = points.corners(points.slot).of(field_.fill, points.inside);
  return points.inside & less_equal(splat(field_.level), fill);
}

template <bool kAny>
FIRN_INLINE void SurfacePacket<kAny>::note(int part, Mask hit, Floats t, std::uint32_t what) {
  best_[part] = select(hit, kAny ? splat(kBlocked) : t, best_[part]);
  particle_[part] = select(hit, splat_int(static_cast<std::int32_t>(what)), particle_[part]);
  found_ = true;
}

// Lanes that are in the snow where they come into the cell or rise into it before `end`, and where (t).
template <bool kAny>
FIRN_INLINE Mask SurfacePacket<kAny>::rise(int part, const CellFill& fill, const Floats from[3], Mask lanes,
                                           Floats begin, Floats end, Floats& t) const {
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

template <bool kAny>
FIRN_INLINE void SurfacePacket<kAny>::test_surface(std::int32_t slot, const int cell[3], bool crossed) {
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
    if (any(hit)) note(part, hit, t, kSurfaceHit);
  }
}

// False where the cell has no list.
template <bool kAny>
FIRN_INLINE bool SurfacePacket<kAny>::test_loose(std::size_t place, const int cell[3]) {
  const std::uint32_t word = find_list(grid_, place, cell);
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
      if (any(nearer)) note(part, nearer, t, static_cast<std::uint32_t>(index));
    }
  }
  return true;
}

template <bool kAny>
bool SurfacePacket<kAny>::test_cells(const CellRange& cells) {
  for (int x = cells.low[0]; x <= cells.high[0]; ++x) {
    for (int y = cells.low[1]; y <= cells.high[1]; ++y) {
      for (int z = cells.low[2]; z <= cells.high[2]; ++z) {
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

template <bool kAny>
Slab SurfacePacket<kAny>::meet(int slab, const CellRange&) {
  for (int k = slab > first_ ? slab : first_; k < slab + kBrickCells; ++k) {
    if (this->plane(k) - reach_ > furthest_) return Slab::ended;
    const Window here = this->window(k, 1);
    CellRange cells;
    if (!this->cells_of(here, k, 1, cells)) continue;
    if (this->wide(here) || !test_cells(cells)) return Slab::declined;
    this->shorten();
  }
  return Slab::passed;
}

template <bool kAny>
void SurfacePacket<kAny>::trace_others() const {
  for (std::uint64_t left = inside_; left != 0; left &= left - 1) {
    const std::size_t i = begin_ + static_cast<std::size_t>(__builtin_ctzll(left));
    (kAny ? surface_occluded : surface_closest)(grid_, field_, rays_, i, i + 1);
  }
}

// False if it declines.
template <bool kAny>
bool trace_packet(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin) {
  SurfacePacket<kAny> packet(grid, field, rays, begin);
  if (!packet.trace()) return false;
  packet.trace_others();
  return true;
}

template <bool kAny>
void trace_coherent(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin,
                    std::size_t end) {
  trace_in_packets(
      begin, end, [&](std::size_t from) { return trace_packet<kAny>(grid, field, rays, from); },
      [&](std::size_t from, std::size_t to) {
        (kAny ? surface_occluded : surface_closest)(grid, field, rays, from, to);
      });
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
