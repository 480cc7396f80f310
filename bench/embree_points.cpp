// SPDX-License-Identifier: MIT
#include "bench/embree_points.h"

#include "src/core/parallel.h"

namespace firn::bench {

EmbreePoints::EmbreePoints(const Balls& balls, int threads)
    : balls_(balls), sphere_(balls.snapshot.size()), scene_(RTC_GEOMETRY_TYPE_SPHERE_POINT, threads) {
  rtcSetSharedGeometryBuffer(scene_.geometry(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sphere_.data(),
                             0, sizeof(Sphere), sphere_.size());
}

void EmbreePoints::build() {
  const Snapshot& s = balls_.snapshot;
  parallel_chunks(sphere_.size(), 16384, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      sphere_[i] = {s.position[0][i], s.position[1][i], s.position[2][i], balls_.radius[i]};
  });
  rtcUpdateGeometryBuffer(scene_.geometry(), RTC_BUFFER_TYPE_VERTEX, 0);
  scene_.commit();
}

}  // namespace firn::bench
