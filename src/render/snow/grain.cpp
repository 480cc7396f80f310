// SPDX-License-Identifier: MIT
#include "src/render/snow/grain.h"

#include <cmath>

#include "src/core/rng.h"

namespace firn {
namespace {

constexpr float kSlope = 0.16f;             // of each octave
constexpr float kCoarse = 2.2f, kFine = 6;  // lattice points a spacing
constexpr float kFacing = 0.02f;            // of a normal to the viewer, at least

// Three values in [-1, 1] at a lattice point.
Vec3f lattice_value(std::uint64_t key, int x, int y, int z) {
  const std::uint64_t bits =
      mix64(key ^ (static_cast<std::uint64_t>(x & 0xffff) << 32) ^
            (static_cast<std::uint64_t>(y & 0xffff) << 16) ^ static_cast<std::uint64_t>(z & 0xffff));
  const auto part = [bits](int shift) { return static_cast<float>(bits >> shift & 0xffff) * 0x1p-15f - 1; };
  return {part(0), part(16), part(32)};
}

Vec3f value_noise(const Vec3f& p, std::uint64_t key) {
  int base[3];
  float f[3];
  for (int a = 0; a < 3; ++a) {
    const float floor = std::floor(p[a]);
    base[a] = static_cast<int>(floor);
    f[a] = p[a] - floor;
    f[a] = f[a] * f[a] * (3 - 2 * f[a]);
  }
  Vec3f sum = Vec3f::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
    const float weight = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
    sum += weight * lattice_value(key, base[0] + x, base[1] + y, base[2] + z);
  }
  return sum;
}

}  // namespace

Vec3f grained(const Vec3f& smooth, const Vec3f& local, std::uint32_t id, const Vec3f& back) {
  const std::uint64_t key = mix64(id);
  const Vec3f slope = kSlope * (value_noise(kCoarse * local, key) + value_noise(kFine * local, ~key));
  const Vec3f normal = (smooth + slope).normalized();
  const float facing = normal.dot(back);
  return facing < kFacing ? Vec3f((normal + (kFacing - facing) * back).normalized()) : normal;
}

}  // namespace firn
