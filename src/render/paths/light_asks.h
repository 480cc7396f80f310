// SPDX-License-Identifier: MIT
// Points that ask for light, many at once: each chooses a point of a light as LightSet::sample() would for it
// alone, and gets a ray that goes there.
#pragma once
#include <cstdint>
#include <vector>

#include "src/render/paths/flights.h"
#include "src/render/sampling/sampler.h"

namespace firn {

class LightAsks {
 public:
  void clear();
  // From p; for whoever `whose` means to the caller. The pair `number` of the path's random numbers chooses
  // the light and the next one the point of it.
  void push(const PathRandom& random, std::uint32_t number, const Vec3f& p, std::uint32_t whose);

  // Sends the rays, to which `share` of the snow's extinction counts: which come through? Their random
  // numbers are those at `link` beyond their points'.
  void send(const World& world, const kernels::ShadeKernels& with, std::uint32_t link, float share);

  std::size_t size() const { return whose_.size(); }
  std::uint32_t whose(std::size_t i) const { return whose_[i]; }
  const Vec3f& through(std::size_t i) const { return through_[i]; }  // what comes through of ray i
  // What it comes from. False if there is nothing.
  bool light(const LightSet& lights, std::size_t i, LightSample& out) const {
    return lights.sample(rays_.origin(i), choice_[i], {u_[i], v_[i]}, out);
  }

 private:
  PathDraws draws_;
  std::vector<std::uint32_t> whose_;
  std::vector<float> choice_, u_, v_;
  RayStream rays_;
  RayMarks marks_;
  std::vector<Vec3f> through_;
};

}  // namespace firn
