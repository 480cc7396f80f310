// SPDX-License-Identifier: MIT
#include "bench/tracer_firn.h"

namespace firn::bench {

FirnTracer::FirnTracer(const Snapshot& snapshot, double radius, const kernels::KernelTable& kernels)
    : snapshot_(snapshot), kernels_(kernels.trace), looks_(1) {
  looks_[0].radius = radius;
}

void FirnTracer::trace(RayKind kind, const kernels::RayView& rays, std::size_t begin, std::size_t end) {
  const auto kernel = kind == RayKind::primary  ? kernels_.closest_coherent
                      : kind == RayKind::shadow ? kernels_.occluded_coherent
                                                : kernels_.closest;
  kernel(grid_.view(), rays, begin, end);
}

std::vector<float> FirnTracer::radii() const {
  std::vector<float> radius(grid_.size());
  for (std::uint32_t sorted = 0; sorted < radius.size(); ++sorted) {
    radius[grid_.snapshot_index(sorted)] = grid_.radius(sorted);
  }
  return radius;
}

}  // namespace firn::bench
