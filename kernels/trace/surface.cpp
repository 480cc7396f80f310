// SPDX-License-Identifier: MIT
// Rays against the implicit surface of the snow: the cells on a ray's way whose corners lie on both sides of
// the level are searched. Within a cell the fill is trilinear, so it is a cubic along the ray: its values at
// four places tell where it rises through the level, and a few secants where exactly. Each ray remembers on
// which side it was, so that rounding at the faces of cells opens no crack.
#include "kernels/trace/cell_list.h"
#include "kernels/trace/corners.h"
#include "kernels/trace/stream.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr int kSecants = 3;

// fill - level along the ray within one cell.
struct AlongCell {
  Floats corner[8];          // z fastest
  Floats from[3], speed[3];  // place in the cell at t = 0, and per metre

  FIRN_INLINE Floats at(Floats t) const {
    Floats u[3];
    for (int a = 0; a < 3; ++a) u[a] = min(max(fma(t, speed[a], from[a]), splat(0)), splat(1));
    const auto mix = [](Floats low, Floats high, Floats part)
                         FIRN_INLINE_LAMBDA { return fma(part, high - low, low); };
    const Floats y0 = mix(mix(corner[0], corner[1], u[2]), mix(corner[2], corner[3], u[2]), u[1]);
    const Floats y1 = mix(mix(corner[4], corner[5], u[2]), mix(corner[6], corner[7], u[2]), u[1]);
    return mix(y0, y1, u[0]);
  }
};

template <bool kAny>
struct SurfaceCells {
  static constexpr int kFewLeaps = kLanes * 3 / 8;
  const TraceGrid& grid;
  const SurfaceField& field;
  Mask outside = mask_of_bits(0);  // was last seen outside
  Mask fresh = mask_of_bits(0);    // nothing known yet

  FIRN_INLINE void strays(const Ray& ray, std::size_t, Nearest& best) const {
    test_bundles<kAny>(grid.strays, 0, grid.stray_bundles, ray, best);
  }
  FIRN_INLINE void start(Mask lanes, const LaneRays&) {
    fresh = fresh | lanes;
    outside = outside & !lanes;
  }
  Mask turned() const { return mask_of_bits(0); }
  void finish(int, const LaneRays&) {}
  FIRN_INLINE void pass(Mask lanes) {
    outside = outside | lanes;
    fresh = fresh & !lanes;
  }

  FIRN_INLINE Mask meet(const Walk& walk, Ints slot, const Mask& lanes, LaneRays& rays) {
    const Ints cell = walk.cell_in(slot) & (kCellsPerBrick - 1);
    const Ints word =
        gather(reinterpret_cast<const std::int32_t*>(field.cell_kind), slot * 8 + (cell >> 3), lanes);
    const Ints bits = word >> (4 * (cell & 7)), kind = bits & 3;
    const Mask has_loose = lanes & equal(bits & splat_int(kHasLoose), splat_int(kHasLoose));
    Mask blocked = mask_of_bits(0);
    if (any(has_loose)) {  // a ball shortens the reach of its ray
      blocked = meet_loose(walk, slot, lane_bits(has_loose), rays);
      if (kAny && !any(lanes & !blocked)) return blocked;
    }
    const Mask crossed = lanes & equal(kind, splat_int(kCrossed));
    const Mask inside = lanes & equal(kind, splat_int(kInside));
    Mask hit = inside & outside;  // through a crack between cells
    Floats t = walk.entered();
    outside = (outside | (lanes & equal(kind, splat_int(kOutside)))) & !inside;
    if (any(crossed)) hit = hit | search(walk, slot, crossed, load(rays.reach), t);
    fresh = fresh & !lanes;
    const int found = lane_bits(hit);
    if (found != 0) {
      float distance[kLanes];
      store(distance, t);
      for (int left = found; left != 0; left &= left - 1) {
        const int lane = __builtin_ctz(static_cast<unsigned>(left));
        rays.reach[lane] = distance[lane];
        rays.particle[lane] = kSurfaceHit;
      }
    }
    return hit | blocked;
  }

 private:
  // The balls in these lanes' cells, lane by lane; returns the lanes that need no more.
  FIRN_INLINE Mask meet_loose(const Walk& walk, Ints slot, int lanes, LaneRays& rays) const {
    std::int32_t places[kLanes], cell[3][kLanes];
    store(places, walk.cell_in(slot));
    for (int a = 0; a < 3; ++a) store(cell[a], walk.cell(a));
    int done = 0;
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(lanes));
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

  FIRN_INLINE AlongCell cell_of(const Walk& walk, Ints slot, Mask lanes) const {
    AlongCell c;
    const Ints first = first_corner(slot, walk.cell(0), walk.cell(1), walk.cell(2));
    for (int k = 0; k < 8; ++k) {
      const int offset = (k >> 2) * kCornerSide * kCornerSide + (k >> 1 & 1) * kCornerSide + (k & 1);
      c.corner[k] = gather(field.fill, first + offset, lanes) - field.level;
    }
    for (int a = 0; a < 3; ++a) {
      c.from[a] = walk.origin(a) * grid.inv_cell - to_float(walk.cell(a));
      c.speed[a] = walk.direction(a) * grid.inv_cell;
    }
    return c;
  }

  // Lanes that rise through the level in their cells, and where (t).
  FIRN_INLINE Mask search(const Walk& walk, Ints slot, Mask lanes, Floats reach, Floats& t) {
    const AlongCell c = cell_of(walk, slot, lanes);
    const Floats begin = walk.entered(), end = max(min(walk.leaves(), reach), begin);
    Floats ta = begin, ga = c.at(begin), tb = begin, gb = ga;
    const Mask below = less(ga, splat(0));
    // Where nothing is known yet, the ray is on the side where it begins.
    Mask out = (outside & !fresh) | (fresh & below);
    Mask hit = lanes & out & !below;  // a crack: it is at `begin`
    Mask open = lanes & !hit, bracketed = mask_of_bits(0);
    Floats t0 = begin, g0 = ga;
    for (int k = 1; k <= 3; ++k) {
      const Floats t1 = k == 3 ? end : fma(splat(static_cast<float>(k) / 3), end - begin, begin);
      const Floats g1 = c.at(t1);
      const Mask rises = open & less(g0, splat(0)) & !less(g1, splat(0));
      ta = select(rises, t0, ta), ga = select(rises, g0, ga);
      tb = select(rises, t1, tb), gb = select(rises, g1, gb);
      bracketed = bracketed | rises;
      open = open & !rises;
      t0 = t1, g0 = g1;
    }
    outside = (outside & !lanes) | (open & less(g0, splat(0)));
    if (!any(bracketed | hit)) return hit;
    Floats at = begin;
    for (int k = 0; k < kSecants; ++k) {
      const Floats part = ga / (ga - gb);
      at = select(bracketed, fma(min(max(part, splat(0)), splat(1)), tb - ta, ta), begin);
      if (k + 1 == kSecants) break;
      const Floats g = c.at(at);
      const Mask low = less(g, splat(0));
      ta = select(low, at, ta), ga = select(low, g, ga);
      tb = select(low, tb, at), gb = select(low, gb, g);
    }
    t = select(lanes, at, t);
    return hit | bracketed;
  }
};

}  // namespace

void surface_closest(const TraceGrid& grid, const SurfaceField& field, const RayView& rays, std::size_t begin,
                     std::size_t end) {
  Stream<false, SurfaceCells<false>>(grid, rays, begin, end, {grid, field}).run();
}

void surface_occluded(const TraceGrid& grid, const SurfaceField& field, const RayView& rays,
                      std::size_t begin, std::size_t end) {
  Stream<true, SurfaceCells<true>>(grid, rays, begin, end, {grid, field}).run();
}

}  // namespace firn::kernels::FIRN_ISA
