// SPDX-License-Identifier: MIT
// Snapshots of points, for tests that need no simulation.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "src/core/vector.h"
#include "src/particles/snapshot.h"

namespace firn::test {

// The first particles of a snapshot; where it has fewer, the rest is 0.
inline Snapshot resized(const Snapshot& from, std::size_t particles) {
  Snapshot to(particles);
  to.frame = from.frame;
  to.time = from.time;
  to.origin = from.origin;
  to.dx = from.dx;
  const std::size_t kept = std::min(particles, from.size());
  for (std::size_t k = 0; k < 3; ++k) {
    std::copy_n(from.position[k].data(), kept, to.position[k].data());
    std::copy_n(from.velocity[k].data(), kept, to.velocity[k].data());
    std::copy_n(from.rotation[k].data(), kept, to.rotation[k].data());
  }
  std::copy_n(from.density.data(), kept, to.density.data());
  std::copy_n(from.volume0.data(), kept, to.volume0.data());
  std::copy_n(from.id.data(), kept, to.id.data());
  std::copy_n(from.object.data(), kept, to.object.data());
  return to;
}

// Points in the order in which they are added, which is their id's, at rest.
class Points {
 public:
  explicit Points(double dx, const Vec3& origin = Vec3::Zero()) : dx_(dx), origin_(origin) {}

  void add(const Vec3& local, double volume) {  // m from the origin, m^3
    place_.push_back(
        {static_cast<float>(local.x()), static_cast<float>(local.y()), static_cast<float>(local.z())});
    volume_.push_back(static_cast<float>(volume));
  }
  Snapshot snapshot(float density = 300) const {
    Snapshot out(place_.size());
    out.dx = dx_;
    out.origin = array_of(origin_);
    for (std::size_t i = 0; i < out.size(); ++i) {
      for (std::size_t a = 0; a < 3; ++a) out.position[a][i] = place_[i][a];
      out.density[i] = density;
      out.volume0[i] = volume_[i];
      out.id[i] = static_cast<std::uint32_t>(i);
    }
    return out;
  }

 private:
  double dx_;
  Vec3 origin_;
  std::vector<std::array<float, 3>> place_;
  std::vector<float> volume_;
};

}  // namespace firn::test
