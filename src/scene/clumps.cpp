// SPDX-License-Identifier: MIT
#include "src/scene/clumps.h"

#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/core/rng.h"

namespace firn {
namespace {

constexpr double kSeamWidth = 0.1;  // of the clump size: how far from a border snow is loosened

// Distances (in cells) to the nearest and the second nearest of the points, one in each unit cell.
struct Nearest {
  double first = 1e300, second = 1e300;

  void meet(double distance) {
    second = std::min(second, std::max(first, distance));
    first = std::min(first, distance);
  }
};

Nearest nearest_points(const Vec3& p, std::uint64_t key) {
  const Vec3 home = p.array().floor();
  Nearest nearest;
  for (int n = 0; n < 27; ++n) {
    const Vec3 cell = home + Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const std::uint64_t h =
        hash_keys(key, std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z()));
    const Vec3 point = cell + Vec3(uniform_double(hash_keys(h, 0)), uniform_double(hash_keys(h, 1)),
                                   uniform_double(hash_keys(h, 2)));
    nearest.meet((point - p).norm());
  }
  return nearest;
}

}  // namespace

std::vector<float> clump_packing(const std::vector<Vec3>& positions, double looseness, double size,
                                 std::uint64_t key) {
  std::vector<float> packing(positions.size());
  parallel_for(positions.size(), 1024, [&](std::size_t i) {
    const Nearest nearest = nearest_points(positions[i] / size, key);
    const double seam = std::max(0.0, 1 - (nearest.second - nearest.first) / (2 * kSeamWidth));
    packing[i] = static_cast<float>(1 + looseness * seam * seam * (3 - 2 * seam));
  });
  return packing;
}

}  // namespace firn
