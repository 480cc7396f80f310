// SPDX-License-Identifier: MIT
// Embree as the trace benchmark uses it: a device, a scene of one geometry, and every way to hand over
// columns of rays. Versions 3 and 4 differ in how a call says that its rays are coherent, and 4 has no
// streams.
#pragma once
#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

#include "bench/rtcore.h"
#include "bench/tracer.h"

namespace firn::bench {

class EmbreeScene {
 public:
  // Of one geometry, to be given its data before commit(). Errors: failed.
  EmbreeScene(RTCGeometryType type, int threads);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  RTCGeometry geometry() const { return geometry_; }
  void commit();  // builds anew; errors: failed
  std::size_t bytes() const { return static_cast<std::size_t>(bytes_.load()); }
  static std::string version();

  // Rays alone, in packets of 8 and 16, in a stream; told to be coherent or not.
  static std::vector<std::string> ways();
  static std::vector<std::string> single_ray_ways();  // the first of them
  // Origins are as in `rays`; rays[..].hit becomes the hit's primID.
  void trace(std::size_t way, RayKind kind, const kernels::RayView& rays, std::size_t begin,
             std::size_t end) const;

 private:
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  RTCGeometry geometry_ = nullptr;
  std::atomic<std::ptrdiff_t> bytes_{0};
};

}  // namespace firn::bench
