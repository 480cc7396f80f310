// SPDX-License-Identifier: MIT
// The grain of the snow (src/render/snow/grain.h) at points: value noise of two octaves, whose lattice values
// are hashes of 64 bits, half a register of floats at a time.
#include "kernels/shade/table.h"
#include "kernels/simd/hash.h"

namespace firn::kernels::FIRN_ISA {
namespace {

constexpr float kSlope = 0.16f;             // of each octave
constexpr float kCoarse = 2.2f, kFine = 6;  // lattice points a spacing
constexpr float kFacing = 0.02f;            // of a normal to the eye, at least

struct Half3 {
  HalfFloats of[3];
};

FIRN_INLINE Half3 value_noise(const HalfFloats p[3], Longs key) {
  HalfInts base[3];
  HalfFloats f[3];
  for (int a = 0; a < 3; ++a) {
    base[a] = floor_to_int(p[a]);
    f[a] = p[a] - to_float(base[a]);
    f[a] = f[a] * f[a] * (3 - 2 * f[a]);
  }
  Half3 sum = {};
#pragma GCC unroll 8
  for (int corner = 0; corner < 8; ++corner) {
    const int step[3] = {corner >> 2, corner >> 1 & 1, corner & 1};
    Longs place[3];
    for (int a = 0; a < 3; ++a) place[a] = widen((HalfBits)((base[a] + step[a]) & 0xffff));
    const Longs bits = mix64(key ^ (place[0] << 32) ^ (place[1] << 16) ^ place[2]);
    const HalfFloats weight =
        (step[0] ? f[0] : 1 - f[0]) * (step[1] ? f[1] : 1 - f[1]) * (step[2] ? f[2] : 1 - f[2]);
    for (int a = 0; a < 3; ++a) sum.of[a] += weight * (bits_to_float(bits, 16 * a, 0xffff) * 0x1p-15f - 1);
  }
  return sum;
}

// To be added to a unit normal.
FIRN_INLINE Half3 grain_slope(const HalfFloats local[3], HalfBits id) {
  const Longs key = mix64(widen(id));
  HalfFloats coarse[3], fine[3];
  for (int a = 0; a < 3; ++a) coarse[a] = kCoarse * local[a], fine[a] = kFine * local[a];
  const Half3 low = value_noise(coarse, key), high = value_noise(fine, ~key);
  Half3 slope;
  for (int a = 0; a < 3; ++a) slope.of[a] = kSlope * (low.of[a] + high.of[a]);
  return slope;
}

FIRN_INLINE void normalize(Floats v[3]) {
  const Floats length = sqrt(fma(v[2], v[2], fma(v[1], v[1], v[0] * v[0])));
  for (int a = 0; a < 3; ++a) v[a] = v[a] / length;
}

}  // namespace

void grain(const GrainView& view, std::size_t begin, std::size_t end, float* const normal[3]) {
  for (std::size_t i = begin; i < end; i += kLanes) {
    const int count = static_cast<int>(end - i < kLanes ? end - i : kLanes);
    alignas(64) float local[3][kLanes], slope[3][kLanes];
    alignas(64) std::int32_t id[kLanes];
    for (int a = 0; a < 3; ++a) store(local[a], load_first(view.local.at[a] + i, count, 0.f));
    store(id, load_first(reinterpret_cast<const std::int32_t*>(view.id) + i, count, 0));
    for (int half = 0; half < kLanes; half += kHalfLanes) {
      HalfFloats p[3];
      for (int a = 0; a < 3; ++a) p[a] = load_half<HalfFloats>(local[a] + half);
      const Half3 its = grain_slope(p, load_half<HalfBits>(id + half));
      for (int a = 0; a < 3; ++a) __builtin_memcpy(slope[a] + half, &its.of[a], sizeof its.of[a]);
    }
    Floats n[3], back[3];
    for (int a = 0; a < 3; ++a) {
      n[a] = load_first(view.smooth.at[a] + i, count, 1.f) + load(slope[a]);
      back[a] = load_first(view.back.at[a] + i, count, 1.f);
    }
    normalize(n);
    const Floats facing = fma(n[2], back[2], fma(n[1], back[1], n[0] * back[0]));
    const Floats turn = max(kFacing - facing, splat(0));
    for (int a = 0; a < 3; ++a) n[a] = fma(turn, back[a], n[a]);
    normalize(n);
    for (int a = 0; a < 3; ++a) store_first(normal[a] + i, count, n[a]);
  }
}

}  // namespace firn::kernels::FIRN_ISA
