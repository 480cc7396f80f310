// SPDX-License-Identifier: MIT
// One frame of the trace benchmark: rebuild, camera rays, shading, a shadow ray from each hit that faces the
// light, a cosine-distributed bounce ray from each hit. Every tracer makes its rays from its own hits; the
// random directions belong to the pixels, so rays differ only as far as hits do.
//
//     build | camera rays | primary | shading | shadow | bounce rays | bounce | sum
//
// The interactive frame is build, primary and shadow, the whole frame these and bounce: what tracers do. What
// lies between is the bench's own, and the same for all.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench/trace_scene.h"
#include "bench/tracer.h"

namespace firn::bench {

// Rays, as many as fit; each pack of kPack rays has a count of those in use, from the pack's start on.
class RayPacks {
 public:
  static constexpr std::size_t kPack = 4096;  // rays
  RayPacks(std::size_t rays);

  kernels::RayView view();
  void push(std::size_t pack, const Vec3f& origin, const Vec3f& direction, float reach, std::uint32_t pixel);
  void clear(std::size_t pack) { used_[pack] = 0; }
  std::size_t packs() const { return used_.size(); }
  std::size_t begin(std::size_t pack) const { return pack * kPack; }
  std::size_t end(std::size_t pack) const { return pack * kPack + used_[pack]; }
  std::size_t size() const;

  std::vector<float> origin[3], direction[3], t;
  std::vector<std::uint32_t> hit, pixel;

 private:
  std::vector<std::size_t> used_;
};

// What was traced and found in rays of one kind.
struct RayTally {
  double seconds = 0;
  std::size_t rays = 0, hits = 0;
  double mean_t = 0;  // m, of the hits; 0 for shadow rays
};

struct FrameTally {
  double build = 0, interactive = 0, frame = 0, shading = 0;  // s; shading: all that lies between
  RayTally rays[kRayKindCount];
};

class TraceFrame {
 public:
  // With `busy_threads`, times are what the processors were busy, divided by so many threads: on a machine
  // that others use too they are those of a machine of our own, if the work is spread evenly. With 0, times
  // are those of the clock on the wall.
  TraceFrame(const TraceScene& scene, int busy_threads);

  FrameTally render(Tracer& tracer);
  // Reflected light of each pixel, row 0 at the top, after render(). The bounce rays gather a sky of 1.
  const std::vector<float>& film() const { return film_; }

 private:
  template <class Work>
  double timed(Work&& work) const;
  void aim_camera(const Vec3& origin);
  RayTally trace(Tracer& tracer, RayKind kind, RayPacks& rays);
  void shade(const Tracer& tracer);
  void scatter();
  void add_light();
  void add_sky();

  const TraceScene& scene_;
  int busy_threads_;
  RayPacks primary_, shadow_, bounce_;
  std::vector<float> normal_[3], cosine_, film_;
  std::vector<Vec3f> sphere_;  // random directions
};

}  // namespace firn::bench
