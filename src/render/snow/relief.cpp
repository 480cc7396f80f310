// SPDX-License-Identifier: MIT
#include "src/render/snow/relief.h"

#include <cmath>

#include "src/core/parallel.h"
#include "src/core/portable_math.h"
#include "src/core/rng.h"
#include "src/core/rotation.h"

namespace firn {
namespace {

constexpr float kLeast = 0.4f, kMost = 1.6f;  // share of a heap's mean volume
// Spacings, half the width of a heap. Less shows the lattice that particles were placed on, more lets single
// parts stand off the surface.
constexpr float kWidth = 0.75f;

// From [0, 1) to a density 1 - |t| over (-1, 1).
float tent(float u) { return u < 0.5f ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 * (1 - u)); }

// The part of a heap: one a cell of detail^3, anywhere in it.
struct Part {
  Vec3f place;   // in spacings
  float weight;  // of volume, not yet one in all
  std::uint32_t id;
};

Part part_of(std::uint32_t id, int k, int detail) {
  const std::uint64_t bits = hash_keys(id, k), more = mix64(bits);
  const int cell[3] = {k / (detail * detail), k / detail % detail, k % detail};
  Part part;
  for (int a = 0; a < 3; ++a) {
    const float within = (static_cast<float>(bits >> (21 * a) & 0x1fffff) + 0.5f) * 0x1p-21f;
    part.place[a] = kWidth * tent((static_cast<float>(cell[a]) + within) / static_cast<float>(detail));
  }
  part.weight = kLeast + (kMost - kLeast) * uniform_float(more);
  part.id = static_cast<std::uint32_t>(more);
  return part;
}

}  // namespace

Snapshot with_relief(const Snapshot& snapshot, int detail) {
  const int parts = detail * detail * detail;
  Snapshot out;
  out.frame = snapshot.frame;
  out.time = snapshot.time;
  out.origin = snapshot.origin;
  out.dx = snapshot.dx;
  out.driven = snapshot.driven;
  out.resize(snapshot.size() * static_cast<std::size_t>(parts));
  parallel_for(snapshot.size(), 256, [&](std::size_t i) {
    const Eigen::Matrix3f turn =
        unpack_rotation({snapshot.rotation[0][i], snapshot.rotation[1][i], snapshot.rotation[2][i]});
    const auto spacing = static_cast<float>(portable_cbrt(snapshot.volume0[i]));
    float weights = 0;
    for (int k = 0; k < parts; ++k) weights += part_of(snapshot.id[i], k, detail).weight;
    for (int k = 0; k < parts; ++k) {
      const Part part = part_of(snapshot.id[i], k, detail);
      const Vec3f from = turn * (spacing * part.place);
      const std::size_t to = i * static_cast<std::size_t>(parts) + static_cast<std::size_t>(k);
      for (int a = 0; a < 3; ++a) {
        out.position[a][to] = snapshot.position[a][i] + from[a];
        out.velocity[a][to] = snapshot.velocity[a][i];
        out.rotation[a][to] = snapshot.rotation[a][i];
      }
      out.density[to] = snapshot.density[i];
      out.volume0[to] = snapshot.volume0[i] * part.weight / weights;
      out.id[to] = part.id;
      out.object[to] = snapshot.object[i];
    }
  });
  return out;
}

}  // namespace firn
