// SPDX-License-Identifier: MIT
// Directions to what lies at infinity: LightSet::distant_direction (src/render/lights/lights.cpp) in lanes.
#include "kernels/shade/table.h"
#include "kernels/simd/math.h"

namespace firn::kernels::FIRN_ISA {
namespace {

struct Direction {
  Floats at[3];

  FIRN_INLINE void take(Mask lanes, const Direction& other) {
    for (int a = 0; a < 3; ++a) at[a] = select(lanes, other.at[a], at[a]);
  }
};

FIRN_INLINE Direction to_sun(const DistantSun& sun, Floats u, Floats v) {
  const Floats down = u * sun.spread, r = sqrt(down * (splat(2) - down));
  Floats sine, cosine;
  sincos_turn(v, sine, cosine);
  Direction out;
  for (int a = 0; a < 3; ++a)
    out.at[a] = fma(r * cosine, splat(sun.side[a]),
                    fma(r * sine, splat(sun.up[a]), (splat(1) - down) * splat(sun.direction[a])));
  return out;
}

// The first of the `count` growing chances from until + first on that is above u, and where in it u lies.
FIRN_INLINE Ints choose(const float* until, Ints first, int count, Floats& u) {
  Ints index = splat_int(0);
  int half = 1;
  while (2 * half < count) half *= 2;
  for (; half > 0; half /= 2) {
    const Ints next = index + half;
    const Mask there = less(next, splat_int(count));
    index = select(there & less_equal(gather(until, first + next - 1, there), u), next, index);
  }
  const Floats before = gather(until, first + index - 1, less(splat_int(0), index));
  const Floats width = gather(until, first + index, all_lanes()) - before;
  u = min(max((u - before) / width, splat(0)), splat(1));
  return index;
}

FIRN_INLINE Direction to_sky(const SkyTable& sky, Floats v, Floats u) {
  const Ints row = choose(sky.until_row, splat_int(0), sky.rows, v);
  const Ints column = choose(sky.until_cell, row * sky.columns, sky.columns, u);
  const Floats y = fma(splat(-2), (to_float(row) + v) / static_cast<float>(sky.rows), splat(1));
  const Floats r = sqrt(max(fma(-y, y, splat(1)), splat(0)));
  Floats sine, cosine;
  sincos_turn((to_float(column) + u) / static_cast<float>(sky.columns), sine, cosine);
  return {{r * sine, y, r * cosine}};
}

}  // namespace

void distant_directions(const DistantLights& lights, const float* choice, const float* u, const float* v,
                        std::size_t begin, std::size_t end, float* const direction[3]) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = end - i < kLanes ? static_cast<int>(end - i) : kLanes;
    const Floats its_u = load_first(u + i, count, 0.f), its_v = load_first(v + i, count, 0.f);
    Floats left = load_first(choice + i, count, 0.f) * lights.strength;
    Direction out = {};
    Mask open = all_lanes();
    for (std::size_t s = 0; s < lights.sun_count && any(open); ++s) {
      const DistantSun& sun = lights.suns[s];
      const bool rest = s + 1 == lights.sun_count && lights.sky.rows == 0;
      const Mask its = rest ? open : open & less(left, splat(sun.strength));
      if (any(its)) out.take(its, to_sun(sun, its_u, its_v));
      open = open & !its;
      left = left - sun.strength;
    }
    if (any(open)) out.take(open, to_sky(lights.sky, its_u, its_v));
    const Floats length = sqrt(fma(out.at[0], out.at[0], fma(out.at[1], out.at[1], out.at[2] * out.at[2])));
    for (int a = 0; a < 3; ++a) store_first(direction[a] + i, count, out.at[a] / length);
  }
}

}  // namespace firn::kernels::FIRN_ISA
