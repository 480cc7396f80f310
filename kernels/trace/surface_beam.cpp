// SPDX-License-Identifier: MIT
// Coherent rays against the implicit surface of the snow: slice after slice, each cell within a beam's bounds
// that the surface crosses is broadcast against the rays of those packets within whose bounds it is. Its
// eight corners are then numbers and not gathers, and the fill is a polynomial of eight coefficients in the
// place in the cell.
//
//     +---+---+---+
//     |   |/##|###|   o--->---    A ray that begins outside meets the snow at the least distance at which
//     +---+---+---+   o--->---    any cell holds the fill of at least the level, so cells can be asked in
//     |  /|###|###|   o--->---    any order, and rounding at their faces opens no crack.
//
// Rays that begin in the snow must leave it first: they go by surface.cpp, as do those that are not coherent.
#include "kernels/trace/beam.h"
#include "kernels/trace/corners.h"

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
class SurfaceBeam : public Beam<SurfaceBeam<kAny>, kAny> {
  using Base = Beam<SurfaceBeam<kAny>, kAny>;

 public:
  SurfaceBeam(const TraceGrid& grid, const SurfaceField& field, const RayView& rays)
      : Base(grid, rays, kCellMargin * grid.cell), field_(field) {}

  // Packets, as Beam's; and the rays that begin in the snow.
  Packets trace(std::size_t begin, int count);

 private:
  friend Base;
  static constexpr float kCellsPerRay = 1.5f;
  using Base::best_, Base::d_, Base::entry_, Base::from_, Base::furthest_, Base::grid_, Base::kRegisters,
      Base::live, Base::o_, Base::particle_, Base::plane, Base::rays_, Base::reach_, Base::heading_;

  void set_aside(int i);
  FIRN_INLINE Mask begins_inside(int i, Mask lanes) const;
  Packets meet(int slab, Packets packets, const Bounds<float>&, const CellRange&);
  FIRN_INLINE Packets meet_slice(int k, Packets packets);
  FIRN_INLINE bool test_loose(Packets packets, std::size_t place, const int cell[3]);
  FIRN_INLINE void test_surface(Packets packets, std::int32_t slot, const int cell[3], bool crossed);
  FIRN_INLINE Mask rise(int i, const CellFill& fill, const Floats from[3], Mask lanes, Floats begin,
                        Floats end, Floats& t) const;
  FIRN_INLINE void note(int i, Mask hit, Floats t, std::uint32_t what);

  const SurfaceField& field_;
  Floats inv_[3][kRegisters];  // of the directions
  int inside_[kRegisters];     // rays that begin in the snow, a bit each
  Packets found_ = 0;          // something in this slice
};

template <bool kAny>
void SurfaceBeam<kAny>::set_aside(int i) {
  for (int a = 0; a < 3; ++a) {
    const Mask flat = less(abs(d_[a][i]), splat(kFlat));
    inv_[a][i] = select(flat, copy_sign(splat(1 / kFlat), d_[a][i]), 1 / d_[a][i]);
  }
  inside_[i] = 0;
  const Mask here = live(i) & less_equal(entry_[i], splat(0));  // begins in the grid
  if (!any(here)) return;
  const Mask inside = begins_inside(i, here);
  inside_[i] = lane_bits(inside);
  best_[i] = select(inside, splat(-1), best_[i]);
}

template <bool kAny>
FIRN_INLINE Mask SurfaceBeam<kAny>::begins_inside(int i, Mask lanes) const {
  const Floats o[3] = {o_[0][i], o_[1][i], o_[2][i]};
  const CellPoints points(grid_, o, lanes);
  if (!any(points.inside)) return points.inside;
  const Floats fill = points.corners(points.slot).of(field_.fill, points.inside);
  return points.inside & less_equal(splat(field_.level), fill);
}

template <bool kAny>
FIRN_INLINE void SurfaceBeam<kAny>::note(int i, Mask hit, Floats t, std::uint32_t what) {
  best_[i] = select(hit, kAny ? splat(kBlocked) : t, best_[i]);
  particle_[i] = select(hit, splat_int(static_cast<std::int32_t>(what)), particle_[i]);
  found_ |= 1u << static_cast<unsigned>(i) / kParts;
}

// Lanes that are in the snow where they come into the cell or rise into it before `end`, and where (t).
template <bool kAny>
FIRN_INLINE Mask SurfaceBeam<kAny>::rise(int i, const CellFill& fill, const Floats from[3], Mask lanes,
                                         Floats begin, Floats end, Floats& t) const {
  const auto value = [&](Floats at) FIRN_INLINE_LAMBDA {
    Floats u[3];
    for (int a = 0; a < 3; ++a)
      u[a] = min(max(fma(at, d_[a][i] * grid_.inv_cell, from[a]), splat(0)), splat(1));
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
FIRN_INLINE void SurfaceBeam<kAny>::test_surface(Packets packets, std::int32_t slot, const int cell[3],
                                                 bool crossed) {
  float low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    low[a] = static_cast<float>(cell[a]) * grid_.cell;
    high[a] = static_cast<float>(cell[a] + 1) * grid_.cell;
  }
  const CellFill fill(field_.fill + static_cast<std::size_t>(slot) * kBrickCorners +
                          ((cell[0] & 3) * kCornerSide + (cell[1] & 3)) * kCornerSide + (cell[2] & 3),
                      field_.level);
  for_each_ray_register(packets, [&](int i) {
    Floats begin = splat(0), end = best_[i];
    for (int a = 0; a < 3; ++a) {
      const Floats first = (low[a] - o_[a][i]) * inv_[a][i];
      const Floats second = (high[a] - o_[a][i]) * inv_[a][i];
      begin = max(begin, min(first, second));
      end = min(end, max(first, second));
    }
    const Mask lanes = live(i) & less_equal(begin, end);
    if (!any(lanes)) return;
    Floats t = begin;
    Mask hit = lanes;
    if (crossed) {
      Floats from[3];
      for (int a = 0; a < 3; ++a) from[a] = o_[a][i] * grid_.inv_cell - static_cast<float>(cell[a]);
      hit = rise(i, fill, from, lanes, begin, end, t);
    }
    if (any(hit)) note(i, hit, t, kSurfaceHit);
  });
}

// False where the cell has no list.
template <bool kAny>
FIRN_INLINE bool SurfaceBeam<kAny>::test_loose(Packets packets, std::size_t place, const int cell[3]) {
  const std::uint32_t word = find_list(grid_, place, cell);
  if (word == kNoList) return false;
  const std::size_t count = word & kMostListed;
  const float* list = grid_.lists + static_cast<std::size_t>(word >> 8) * kListUnit;
  for (std::size_t k = 0; k < count; ++k) {
    const Floats r2 =
        splat(grid_.radius != nullptr ? list[4 * count + k] : grid_.max_radius * grid_.max_radius);
    std::int32_t index;
    __builtin_memcpy(&index, list + 3 * count + k, sizeof index);
    for_each_ray_register(packets, [&](int i) {
      const Floats c[3] = {list[k] - o_[0][i], list[count + k] - o_[1][i], list[2 * count + k] - o_[2][i]};
      const Floats d[3] = {d_[0][i], d_[1][i], d_[2][i]};
      Floats along;
      const Floats depth2 = project(c, d, r2, along);
      if (!any(less_equal(splat(0), depth2))) return;
      const Floats t = along - sqrt(depth2);  // NaN where missed: every comparison is then false
      // Flipping the sign bit orders unsigned indices as signed ones.
      const Mask lower = less(splat_int(index) ^ INT32_MIN, particle_[i] ^ INT32_MIN);
      const Mask nearer = less(splat(0), t) & (less(t, best_[i]) | (less_equal(t, best_[i]) & lower));
      if (any(nearer)) note(i, nearer, t, static_cast<std::uint32_t>(index));
    });
  }
  return true;
}

// Those within whose bounds a cell is are asked of it. Returns those that decline.
template <bool kAny>
FIRN_INLINE Packets SurfaceBeam<kAny>::meet_slice(int k, Packets packets) {
  const float near = plane(k), far = plane(k + 1);
  const Bounds<Floats> b = this->bounds();
  const Floats furthest = load(furthest_);
  const Mask here = mask_of_bits(static_cast<int>(packets)) & less_equal(splat(near - reach_), furthest) &
                    less_equal(b.from, splat(far + reach_));
  if (!any(here)) return 0;
  const Floats first = max(near - b.from, splat(0)), last = max(min(splat(far), furthest) - b.from, first);
  Ints low[2], high[2];
  CellRange cells;
  cells.low[heading_.main] = cells.high[heading_.main] =
      heading_.forward ? k : grid_.cells[heading_.main] - 1 - k;
  for (int side = 0; side < 2; ++side) {
    const int a = heading_.side[side];
    const Mask falls = less(b.low_slope[side], splat(0)), sinks = less(b.high_slope[side], splat(0));
    const Floats from = fma(select(falls, last, first), b.low_slope[side], b.low[side]) * grid_.inv_cell,
                 to = fma(select(sinks, first, last), b.high_slope[side], b.high[side]) * grid_.inv_cell;
    const Floats end = splat(static_cast<float>(grid_.cells[a]));
    const auto cell_of_place = [&](Floats place) {
      return __builtin_convertvector(max(min(place, end), splat(-1)) + 1, Ints) - 1;
    };
    low[side] = cell_of_place(from);
    high[side] = cell_of_place(to);
    const float least = -greatest_lane(select(here, -from, splat(-kFar))),
                most = greatest_lane(select(here, to, splat(-kFar)));
    if (!(most >= 0 && least < end[0])) return 0;
    cells.low[a] = least > 0 ? static_cast<int>(least) : 0;
    cells.high[a] = most < end[0] ? static_cast<int>(most) : grid_.cells[a] - 1;
  }
  Packets declining = 0;
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
        if ((bits & kHasLoose) == 0 && (bits & 3) == kOutside) continue;
        const Ints u = splat_int(cell[heading_.side[0]]), v = splat_int(cell[heading_.side[1]]);
        const Packets its =
            ~declining & static_cast<Packets>(lane_bits(here & !(less(u, low[0]) | less(high[0], u) |
                                                                 less(v, low[1]) | less(high[1], v))));
        if (its == 0) continue;
        if ((bits & kHasLoose) != 0 && !test_loose(its, place, cell)) declining |= its;
        if ((bits & 3) != kOutside) test_surface(its, slot, cell, (bits & 3) == kCrossed);
      }
    }
  }
  for_each_packet(found_ & ~declining, [&](int p) { this->shorten(p); });
  found_ = 0;
  return declining;
}

template <bool kAny>
Packets SurfaceBeam<kAny>::meet(int slab, Packets packets, const Bounds<float>&, const CellRange&) {
  Packets declining = 0;
  for (int k = slab; k < slab + kBrickCells; ++k) declining |= meet_slice(k, packets & ~declining);
  return declining;
}

template <bool kAny>
Packets SurfaceBeam<kAny>::trace(std::size_t begin, int count) {
  const Packets declined = Base::trace(begin, count);
  for (int p = 0; p < count; ++p) {
    if ((declined >> p & 1) != 0) continue;
    for_each_part(p, [&](int i) {
      for (int left = inside_[i]; left != 0; left &= left - 1) {
        const std::size_t ray =
            begin + static_cast<std::size_t>(i * kLanes + __builtin_ctz(static_cast<unsigned>(left)));
        (kAny ? surface_occluded : surface_closest)(grid_, field_, rays_, ray, ray + 1);
      }
    });
  }
  return declined;
}

template <bool kAny>
void trace_coherent(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin,
                    std::size_t end) {
  SurfaceBeam<kAny> beam(grid, field, rays);
  trace_in_beams(beam, begin, end, [&](std::size_t from, std::size_t to) {
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
