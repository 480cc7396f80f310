// SPDX-License-Identifier: MIT
// Rays through the snow as a medium: how far each gets until it collides, by delta tracking (Woodcock et al.
// 1965) with a majorant a cell. A ray carries the optical depth that is left to its next tentative collision
// from cell to cell; there the extinction is read, and the collision is real with extinction / majorant.
// Random numbers are functions of a ray's key and of how many it has drawn, so that its lane does not matter.
// Walks (`wander`) turn where they collide and go on in their lanes.
#include "kernels/simd/math.h"
#include "kernels/trace/cell_list.h"
#include "kernels/trace/corners.h"
#include "kernels/trace/stream.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr std::uint32_t kClassAt = 1u << 28;  // of WalkView::scattered

// The finaliser of MurmurHash3 (Appleby), a bijection in which every bit depends on every bit.
template <class T>
FIRN_INLINE T scramble(T h) {
  h ^= h >> 16;
  h *= 0x85ebca6bu;
  h ^= h >> 13;
  h *= 0xc2b2ae35u;
  return h ^ (h >> 16);
}
// The n-th number of a ray, of the two halves of its key.
template <class T>
FIRN_INLINE T random_bits(T low, T high, T n) {
  return scramble<T>(scramble<T>(low + n * 0x9e3779b9u) ^ high);
}
// Uniform in [0, 1), 24 bits.
FIRN_INLINE Floats uniform(Bits random) { return to_float((Ints)(random >> 8)) * splat(0x1p-24f); }
// Of an exponential distribution of mean 1: -log of a number in (0, 1].
FIRN_INLINE Floats exponential(Bits random) { return -log(uniform(random) + 0x1p-24f); }

template <bool kWanders>
struct MediumCells {
  static constexpr int kFewLeaps = kLanes / 8;
  const TraceGrid& grid;
  const MediumField& field;
  const std::uint64_t* key;
  const float* share;
  WalkView walks = {};
  alignas(64) std::int32_t low[kLanes] = {}, high[kLanes] = {};  // of the lanes' keys
  Bits drawn = {};
  Floats depth = {};    // optical, to the next tentative collision
  Floats from = {};     // m, where the last one was
  Floats mean = {};     // optical depth between tentative collisions, 1 / share
  Mask colliding = {};  // lanes at a tentative collision,
  Ints word = {};       // in a cell of this word
  // Of walks.
  Mask watched = {};  // lanes on whose flight something else than snow might be
  Mask turned_ = {};
  alignas(64) std::int32_t scattered[kLanes] = {}, listed[kLanes] = {};

  // What strays are made of is not in the field, so they add to it: each has a collision of its own.
  inline void strays(const Ray& ray, std::size_t i, Nearest& best) const;

  FIRN_INLINE void start(Mask lanes, const LaneRays& rays) {
    alignas(64) float its_share[kLanes];
    store(its_share, splat(1));
    for (int left = lane_bits(lanes); left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(left));
      const std::uint64_t its = key[rays.ray[lane]];
      low[lane] = static_cast<std::int32_t>(its);
      high[lane] = static_cast<std::int32_t>(its >> 32);
      if (share != nullptr) its_share[lane] = share[rays.ray[lane]];
    }
    drawn = (Bits)select(lanes, splat_int(0), (Ints)drawn);
    from = select(lanes, splat(0), from);
    if (kWanders) {
      watched = (watched & !lanes) | (lanes & less(splat(0), load(rays.entry)));  // those from outside
      store(scattered, select(lanes, splat_int(0), load(scattered)));
      store(listed, select(lanes, splat_int(0), load(listed)));
    }
    mean = select(lanes, splat(1) / load(its_share), mean);
    depth = select(lanes, exponential(draw(lanes)) * mean, depth);
  }
  FIRN_INLINE void pass(Mask lanes) {
    if (kWanders) watched = watched | lanes;
  }
  FIRN_INLINE Mask turned() const { return kWanders ? turned_ : mask_of_bits(0); }
  FIRN_INLINE void finish(int lane, const LaneRays& rays) {
    if (!kWanders) return;
    const std::size_t i = rays.ray[lane];
    walks.scattered[i] = static_cast<std::uint32_t>(scattered[lane]);
    if (scattered[lane] == 0) return;
    for (int a = 0; a < 3; ++a) {
      walks.origin[a][i] = rays.o[a][lane];
      walks.direction[a][i] = rays.d[a][lane];
    }
  }

  // Lanes whose rays come to a tentative collision wait there until there are some of them: whether it is
  // real, and where walks go from there, costs as much for one lane as for all.
  FIRN_INLINE Mask meet(const Walk& walk, Ints slot, Mask& lanes, LaneRays& rays) {
    turned_ = mask_of_bits(0);
    const Ints place = walk.cell_in(slot);
    Mask waiting = lanes & colliding, flying = lanes & !colliding;
    if (any(flying)) waiting = waiting | fly(walk, place, flying, rays);
    lanes = flying & !waiting;
    const int ready = __builtin_popcount(static_cast<unsigned>(lane_bits(waiting)));
    colliding = waiting;
    if (ready == 0 || (ready < kFewCollide && any(lanes))) return mask_of_bits(0);
    colliding = mask_of_bits(0);
    return collide(walk, slot, place, waiting, rays);
  }

 private:
  static constexpr int kFewCollide = kLanes * 3 / 8;

  // To the ends of their cells; returns those that come to a tentative collision before.
  FIRN_INLINE Mask fly(const Walk& walk, Ints place, Mask lanes, const LaneRays& rays) {
    const Ints here = gather(reinterpret_cast<const std::int32_t*>(field.cell), place, lanes);
    const auto majorant = (Floats)(here & static_cast<std::int32_t>(kMostExtinction));
    if (kWanders) watched = watched | (lanes & less(here, splat_int(0)));  // kShared
    const Floats begin = max(from, walk.entered());
    const Floats end = max(min(walk.leaves(), load(rays.reach)), begin);
    const Floats t = begin + depth / majorant;  // no number where there is no snow
    const Mask tentative = lanes & less(splat(0), majorant) & less(t, end);
    depth = select(lanes & !tentative, max(fma(-majorant, end - begin, depth), splat(0)), depth);
    from = select(tentative, t, from);
    word = (Ints)select(tentative, (Floats)here, (Floats)word);
    return tentative;
  }

  // Of lanes at a tentative collision, those that are done. Most are known to be real or not before the
  // density is.
  FIRN_INLINE Mask collide(const Walk& walk, Ints slot, Ints place, Mask lanes, LaneRays& rays) {
    const auto majorant = (Floats)(word & static_cast<std::int32_t>(kMostExtinction));
    const Floats part = uniform(draw(lanes)) * majorant;
    const Floats least =
        to_float((word >> kLeastAt) & ((1 << kLeastBits) - 1)) * majorant * (1.f / (1 << kLeastBits));
    Mask real = lanes & less(part, least);
    const Mask open = lanes & !real;
    if (any(open)) real = real | (open & less(part, extinction(walk, slot, place, open)));
    const Mask null = lanes & !real;
    if (!kWanders) {
      if (any(null)) depth = select(null, exponential(draw(null)) * mean, depth);
      record(real, collision_code(word), from, rays);
      return real;
    }
    const Mask stop = any(real) ? wander(walk, real, rays) : real;
    const Mask on = lanes & !stop;
    if (any(on)) depth = select(on, exponential(draw(on)) * mean, depth);
    return stop;
  }

  FIRN_INLINE Bits draw(Mask lanes) {
    const Bits random = random_bits<Bits>((Bits)load(low), (Bits)load(high), drawn);
    drawn = (Bits)select(lanes, (Ints)(drawn + 1), (Ints)drawn);
    return random;
  }

  // 1/m, where the lanes collide.
  FIRN_INLINE Floats extinction(const Walk& walk, Ints slot, Ints place, Mask lanes) const {
    const Ints cell = place & (kCellsPerBrick - 1);
    const Ints bits =
        gather(reinterpret_cast<const std::int32_t*>(field.cell_kind), place >> 3, lanes) >> (4 * (cell & 7));
    Corners corners;
    corners.first = first_corner(slot, walk.cell(0), walk.cell(1), walk.cell(2));
    Floats p[3];
    for (int a = 0; a < 3; ++a) {
      p[a] = fma(from, walk.direction(a), walk.origin(a));
      corners.part[a] =
          min(max(fma(p[a], splat(grid.inv_cell), -to_float(walk.cell(a))), splat(0)), splat(1));
    }
    const Floats density = corners.of(field.density, lanes);
    const Ints kind = bits & 3;
    Mask snow = lanes & equal(kind, splat_int(kInside));
    const Mask crossed = lanes & equal(kind, splat_int(kCrossed));
    if (any(crossed))
      snow = snow | (crossed & less_equal(splat(field.level), corners.of(field.fill, crossed)));
    Floats clipped = select(snow, density, splat(0));
    const Mask loose = lanes & equal(bits & splat_int(kHasLoose), splat_int(kHasLoose));
    if (any(loose)) {
      const Floats its = field.ball_density < 0 ? density : splat(field.ball_density);
      clipped = select(in_balls(grid, loose, p), max(clipped, its), clipped);
    }
    const Mask shallow = equal(class_of(word), splat_int(0));
    return clipped * select(shallow, splat(field.extinction), splat(field.reduced));
  }

  // Of MediumField::cell.
  FIRN_INLINE static Ints class_of(Ints word) { return word & static_cast<std::int32_t>(kClass); }
  FIRN_INLINE static Ints collision_code(Ints word) {
    static_assert(kInThickSnow == 2 * kThickSnow);
    return class_of(word) + 2 * (word & static_cast<std::int32_t>(kThickSnow));
  }

  FIRN_INLINE static void record(Mask real, Ints code, Floats t, LaneRays& rays) {
    store(rays.reach, select(real, t, load(rays.reach)));
    std::int32_t codes[kLanes];
    store(codes, code);
    for (int left = lane_bits(real); left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(left));
      rays.particle[lane] = static_cast<std::uint32_t>(codes[lane]);
    }
  }

  // Of the lanes that collide, those that stop; the others scatter.
  FIRN_INLINE Mask wander(const Walk& walk, Mask lanes, LaneRays& rays) {
    const Ints depth_class = class_of(word), code = collision_code(word);
    const Mask whole = !less(splat(1), mean);  // rays to which all of the extinction counts do not walk
    const Floats chance = gather(field.lit, depth_class, lanes);
    const Mask lit = lanes & (whole | less(uniform(draw(lanes)), chance));
    const Ints count = load(scattered), times = count & static_cast<std::int32_t>(kClassAt - 1);
    const Mask tired = !less(times, splat_int(static_cast<std::int32_t>(field.most_scattered)));
    const Mask full = lit & !less(load(listed), splat_int(static_cast<std::int32_t>(kMostLit)));
    const Mask stop = lanes & (whole | watched | tired | full);
    record(stop, select(lit, code, code + kUnlit), from, rays);
    turned_ = lanes & !stop;
    if (!any(turned_)) return stop;
    store(scattered, select(turned_, times + 1 + depth_class * static_cast<std::int32_t>(kClassAt), count));
    for (int a = 0; a < 3; ++a)
      store(rays.o[a], select(turned_, fma(from, walk.direction(a), walk.origin(a)), load(rays.o[a])));
    list(turned_ & lit, rays);
    const Floats z = fma(splat(-2), uniform(draw(turned_)), splat(1));
    const Floats r = sqrt(max(fma(-z, z, splat(1)), splat(0)));
    Floats sine, cosine;
    sincos_turn(uniform(draw(turned_)), sine, cosine);
    const Floats direction[3] = {r * cosine, r * sine, z};
    for (int a = 0; a < 3; ++a) store(rays.d[a], select(turned_, direction[a], load(rays.d[a])));
    store(rays.reach, select(turned_, splat(__builtin_huge_valf()), load(rays.reach)));
    store(rays.entry, select(turned_, splat(0), load(rays.entry)));
    watched = watched & !turned_;
    from = select(turned_, splat(0), from);
    return stop;
  }

  // Walks that are where they collided.
  FIRN_INLINE void list(Mask lit, const LaneRays& rays) {
    for (int left = lane_bits(lit); left != 0; left &= left - 1) {
      const int lane = __builtin_ctz(static_cast<unsigned>(left));
      ++listed[lane];
      walks.lit[(*walks.lit_count)++] = {{rays.o[0][lane], rays.o[1][lane], rays.o[2][lane]},
                                         static_cast<std::uint32_t>(rays.ray[lane]),
                                         static_cast<std::uint32_t>(scattered[lane])};
    }
  }
};

template <bool kWanders>
void MediumCells<kWanders>::strays(const Ray& ray, std::size_t i, Nearest& best) const {
  const float its_share = share != nullptr ? share[i] : 1.f;
  const Floats d[3] = {splat(ray.d[0]), splat(ray.d[1]), splat(ray.d[2])};
  for (std::uint64_t b = 0; b < grid.stray_bundles; ++b) {
    const BallBundle& balls = grid.strays[b];
    for (int part = 0; part < kRayLanes; part += kLanes) {
      const Floats c[3] = {load(balls.x + part) - ray.o[0], load(balls.y + part) - ray.o[1],
                           load(balls.z + part) - ray.o[2]};
      Floats along;
      const Floats depth2 = project(c, d, load(balls.r2 + part), along);
      if (!any(less(splat(0), depth2))) continue;
      const Floats half = sqrt(max(depth2, splat(0)));
      // Numbers from the far end of what a ray may draw, one a stray.
      const Bits number = (Bits)(lane_numbers() + static_cast<std::int32_t>(b * kRayLanes) + part);
      const Bits random =
          random_bits<Bits>((Bits)splat_int(static_cast<std::int32_t>(key[i])),
                            (Bits)splat_int(static_cast<std::int32_t>(key[i] >> 32)), ~number);
      const Floats t =
          max(along - half, splat(0)) +
          exponential(random) / (its_share * load(field.stray_extinction + b * kRayLanes + part));
      int found = lane_bits(less(splat(0), depth2) & less(t, along + half) & less(t, splat(best.t)));
      float distance[kLanes];
      store(distance, t);
      for (; found != 0; found &= found - 1) {
        const int lane = __builtin_ctz(static_cast<unsigned>(found));
        if (distance[lane] < best.t) best = {distance[lane], 0};
      }
    }
  }
}

}  // namespace

void collide(const TraceGrid& grid, const MediumField& field, const RayView& rays, const std::uint64_t* key,
             const float* share, std::size_t begin, std::size_t end) {
  Stream<false, MediumCells<false>>(grid, rays, begin, end, {grid, field, key, share}).run();
}

void wander(const TraceGrid& grid, const MediumField& field, const WalkView& walks, const std::uint64_t* key,
            const float* share, std::size_t begin, std::size_t end) {
  const RayView rays{{walks.origin[0], walks.origin[1], walks.origin[2]},
                     {walks.direction[0], walks.direction[1], walks.direction[2]},
                     walks.t,
                     walks.hit};
  for (std::size_t i = begin; i < end; ++i) walks.scattered[i] = 0;
  Stream<false, MediumCells<true>>(grid, rays, begin, end, {grid, field, key, share, walks}).run();
}

}  // namespace firn::kernels::FIRN_ISA
