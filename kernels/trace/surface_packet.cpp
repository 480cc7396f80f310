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
#include "kernels/trace/ball_test.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/table.h"
#include "kernels/trace/walk.h"

namespace firn::kernels::FIRN_ISA {

void surface_closest(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);
void surface_occluded(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t, std::size_t);

namespace {

constexpr int kLarge = 64, kSmall = 16;  // rays
constexpr int kSecants = 3;
constexpr float kMinMainShare = 0.4f;  // of every direction along the main axis
constexpr float kFar = 3e38f, kFlat = 1e-20f;

// An interval of each of the two axes beside the main one.
struct Window {
  float low[2], high[2];
};

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
class SurfacePacket {
 public:
  static constexpr int kParts = kRays / kLanes;

  SurfacePacket(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin)
      : grid_(grid), field_(field), rays_(rays), begin_(begin), margin_(kCellMargin * grid.cell) {}

  // Strays first, then each ray moved to the grid; false if no ray meets it.
  bool load_rays();
  // Chooses the axis that the rays go along most; false if they do not all go the same way.
  bool choose_main();
  // False if the packet is or grows wider than `widest` cells, or comes upon a cell without a list of its
  // loose balls; what it has found then is not all.
  bool walk(float widest);
  void store_hits() const;
  // The rays that begin in the snow.
  void trace_others() const;

 private:
  FIRN_INLINE Mask live(int part) const { return less_equal(splat(0), best_[part]); }
  FIRN_INLINE Mask begins_inside(int part, Mask lanes) const;
  void look_ahead(float from);
  FIRN_INLINE void shorten();
  FIRN_INLINE Window window(float near, float far) const;
  FIRN_INLINE bool cells_of(const Window& window, int first, int last, int low[3], int high[3]) const;
  int clearance(const int low[3], const int high[3]) const;
  bool test_cells(const int low[3], const int high[3]);
  FIRN_INLINE bool test_loose(std::size_t place, const int cell[3]);
  FIRN_INLINE void test_surface(std::int32_t slot, const int cell[3], bool crossed);
  FIRN_INLINE Mask rise(int part, const CellFill& fill, const Floats from[3], Mask lanes, Floats begin,
                        Floats end, Floats& t) const;
  FIRN_INLINE void note(int part, Mask hit, Floats t, Ints what);

  const TraceGrid& grid_;
  const SurfaceField& field_;
  const RayView& rays_;
  std::size_t begin_;
  float margin_;                                      // m, for rounding
  Floats o_[3][kParts], d_[3][kParts], inv_[3][kParts];  // m; origins moved to the grid's edge
  Floats best_[kParts];                               // m from the moved origin; negative: not in the grid
  Ints particle_[kParts];                             // the bits of a sorted index, or kSurfaceHit
  double entry_[kRays];
  std::uint64_t inside_ = 0;  // rays that begin in the snow, a bit each
  int main_, side_[2];        // axes
  bool forward_;
  bool found_ = false;  // something since the bounds were drawn
  // As in packet.cpp: bounds of the rays that may still meet something, at the plane from_ and per metre
  // along the main axis up to the plane to_; furthest_ is how far along it they reach. Coordinates along the
  // main axis count up in the rays' direction.
  float from_, to_, furthest_;
  Window at_, slope_;
};

template <int kRays, bool kAny>
bool SurfacePacket<kRays, kAny>::load_rays() {
  float o[3][kRays], d[3][kRays], best[kRays];
  for (int lane = 0; lane < kRays; ++lane) rays_.hit[begin_ + lane] = kNoHit;
  for (int lane = 0; lane < kRays && grid_.stray_bundles > 0; ++lane) {
    Nearest stray{rays_.t[begin_ + lane], kNoHit};
    test_bundles<kAny>(grid_.strays, 0, grid_.stray_bundles, load_ray(rays_, begin_ + lane), stray);
    if (stray.particle == kNoHit) continue;
    rays_.hit[begin_ + lane] = kAny ? 0 : stray.particle;
    if (!kAny) rays_.t[begin_ + lane] = stray.t;
  }
  for (int lane = 0; lane < kRays; ++lane) {
    const Ray ray = load_ray(rays_, begin_ + lane);
    float moved[3];
    enter_grid(grid_, ray.o, ray.d, rays_.t[begin_ + lane], moved, entry_[lane], best[lane]);
    for (int a = 0; a < 3; ++a) o[a][lane] = moved[a], d[a][lane] = ray.d[a];
  }
  int within[kRays];  // begins in the grid
  for (int lane = 0; lane < kRays; ++lane) {
    if (kAny && rays_.hit[begin_ + lane] != kNoHit) best[lane] = -1;
    within[lane] = entry_[lane] <= 0 ? -1 : 0;
  }
  Mask some = mask_of_bits(0);
  for (int part = 0; part < kParts; ++part) {
    for (int a = 0; a < 3; ++a) {
      o_[a][part] = load(o[a] + part * kLanes);
      d_[a][part] = load(d[a] + part * kLanes);
      const Mask flat = less(abs(d_[a][part]), splat(kFlat));
      inv_[a][part] = select(flat, copy_sign(splat(1 / kFlat), d_[a][part]), 1 / d_[a][part]);
    }
    best_[part] = load(best + part * kLanes);
    particle_[part] = splat_int(-1);
    const Mask here = live(part) & equal(load(within + part * kLanes), splat_int(-1));
    if (any(here)) {
      const Mask inside = begins_inside(part, here);
      inside_ |= static_cast<std::uint64_t>(lane_bits(inside)) << (part * kLanes);
      best_[part] = select(inside, splat(-1), best_[part]);
    }
    some = some | live(part);
  }
  return any(some);
}

template <int kRays, bool kAny>
FIRN_INLINE Mask SurfacePacket<kRays, kAny>::begins_inside(int part, Mask lanes) const {
  Ints cell[3];
  Floats u[3];
  for (int a = 0; a < 3; ++a) {
    const Floats last = splat(static_cast<float>(grid_.cells[a] - 1)), at = o_[a][part] * grid_.inv_cell;
    cell[a] = __builtin_convertvector(max(min(at, last), splat(0)), Ints);
    u[a] = min(max(at - to_float(cell[a]), splat(0)), splat(1));
  }
  const Ints brick = ((cell[0] >> 2) * grid_.bricks[1] + (cell[1] >> 2)) * grid_.bricks[2] + (cell[2] >> 2);
  const Ints slot = gather(grid_.slot, brick, lanes);
  lanes = lanes & !less(slot, splat_int(0));
  if (!any(lanes)) return lanes;
  const Ints first = slot * kBrickCorners + (cell[0] & 3) * (kCornerSide * kCornerSide) +
                     (cell[1] & 3) * kCornerSide + (cell[2] & 3);
  Floats corner[8];
  for (int k = 0; k < 8; ++k) {
    const int offset = (k >> 2) * kCornerSide * kCornerSide + (k >> 1 & 1) * kCornerSide + (k & 1);
    corner[k] = gather(field_.fill, first + offset, lanes);
  }
  for (int a = 2, n = 4; a >= 0; --a, n /= 2) {  // z, then y, then x
    for (int k = 0; k < n; ++k) corner[k] = fma(u[a], corner[2 * k + 1] - corner[2 * k], corner[2 * k]);
  }
  return lanes & less_equal(splat(field_.level), corner[0]);
}

template <int kRays, bool kAny>
bool SurfacePacket<kRays, kAny>::choose_main() {
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
template <int kRays, bool kAny>
void SurfacePacket<kRays, kAny>::look_ahead(float from) {
  Floats nearest = splat(kFar), furthest = splat(-kFar);
  Mask ahead[kParts];
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    const Floats end = fma(best_[part], speed, along);
    ahead[part] = live(part) & less_equal(splat(from), end);
    nearest = min(nearest, select(ahead[part], along, splat(kFar)));
    furthest = max(furthest, select(ahead[part], end, splat(-kFar)));
  }
  furthest_ = greatest_lane(furthest);
  const float least = -greatest_lane(-nearest),
              edge = forward_ ? grid_.cell * static_cast<float>(grid_.cells[main_]) : 0;
  from_ = least > from ? least : from;
  to_ = furthest_ < edge ? furthest_ : edge;
  to_ = to_ > from_ + grid_.cell ? to_ : from_ + grid_.cell;
  for (int side = 0; side < 2; ++side) {
    Floats low[2] = {splat(kFar), splat(kFar)}, high[2] = {splat(-kFar), splat(-kFar)};
    for (int part = 0; part < kParts; ++part) {
      const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
      const Floats slope = d_[side_[side]][part] * (forward_ ? inv_[main_][part] : -inv_[main_][part]);
      for (int plane = 0; plane < 2; ++plane) {
        const Floats at = fma(splat(plane == 0 ? from_ : to_) - along, slope, o_[side_[side]][part]);
        low[plane] = min(low[plane], select(ahead[part], at, splat(kFar)));
        high[plane] = max(high[plane], select(ahead[part], at, splat(-kFar)));
      }
    }
    at_.low[side] = -greatest_lane(-low[0]);
    at_.high[side] = greatest_lane(high[0]);
    const float length = to_ - from_;
    slope_.low[side] = (-greatest_lane(-low[1]) - at_.low[side]) / length;
    slope_.high[side] = (greatest_lane(high[1]) - at_.high[side]) / length;
  }
}

// How far the rays reach, once some have found something.
template <int kRays, bool kAny>
FIRN_INLINE void SurfacePacket<kRays, kAny>::shorten() {
  Floats furthest = splat(-kFar);
  for (int part = 0; part < kParts; ++part) {
    const Floats along = forward_ ? o_[main_][part] : -o_[main_][part];
    const Floats speed = forward_ ? d_[main_][part] : -d_[main_][part];
    furthest = max(furthest, select(live(part), fma(best_[part], speed, along), splat(-kFar)));
  }
  furthest_ = greatest_lane(furthest);
}

// The rays' bounds between two planes, with a margin.
template <int kRays, bool kAny>
FIRN_INLINE Window SurfacePacket<kRays, kAny>::window(float near, float far) const {
  const float length = to_ - from_;
  const auto inside = [&](float along) { return along < 0 ? 0 : along > length ? length : along; };
  const float first = inside(near - from_), last = inside(far - from_);
  Window w;
  for (int side = 0; side < 2; ++side) {
    const float low = slope_.low[side] < 0 ? last : first, high = slope_.high[side] < 0 ? first : last;
    w.low[side] = at_.low[side] + low * slope_.low[side] - margin_;
    w.high[side] = at_.high[side] + high * slope_.high[side] + margin_;
  }
  return w;
}

// The cells of slices first to last (counted up the axis) within the window; false if there are none.
template <int kRays, bool kAny>
FIRN_INLINE bool SurfacePacket<kRays, kAny>::cells_of(const Window& w, int first, int last, int low[3],
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

// How many bricks, beginning with those of these cells, are empty whichever way one goes; 0: one of them is
// not.
template <int kRays, bool kAny>
int SurfacePacket<kRays, kAny>::clearance(const int low[3], const int high[3]) const {
  int least = 1 << 20;
  for (int x = low[0] >> 2; x <= high[0] >> 2; ++x) {
    for (int y = low[1] >> 2; y <= high[1] >> 2; ++y) {
      for (int z = low[2] >> 2; z <= high[2] >> 2; ++z) {
        const std::int32_t slot = grid_.slot[brick_at(grid_, x, y, z)];
        if (slot >= 0) return 0;
        least = -slot < least ? -slot : least;
      }
    }
  }
  return least;
}

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
      for (int a = 0; a < 3; ++a)
        from[a] = o_[a][part] * grid_.inv_cell - static_cast<float>(cell[a]);
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
    const Floats r2 = splat(grid_.radius != nullptr ? list[4 * count + i] : grid_.max_radius * grid_.max_radius);
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
      const Mask nearer =
          less(splat(0), t) & (less(t, best_[part]) | (less_equal(t, best_[part]) & lower));
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
    if (!cells_of(window(plane(slab) - margin_, plane(slab + kBrickCells) + margin_), least, last, low,
                  high))
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
