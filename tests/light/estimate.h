// SPDX-License-Identifier: MIT
// Pictures as measurements: a number with its standard error, and how far from expectation a set of them
// lies.
#pragma once
#include <cmath>
#include <cstddef>
#include <vector>

#include "src/core/parallel.h"
#include "tests/light/pictures.h"

namespace firn::test {

struct Estimate {
  double mean = 0, error = 0;  // error: one standard deviation of the mean
};

// What one camera ray brings back, from position towards target: `side` x `side` pixels of their own random
// numbers.
Picture picture_along(RenderSetup setup, const Snapshot& snapshot, const Vec3& position, const Vec3& target,
                      int side, int samples);
// A channel of such a picture.
Estimate channel_of(const Picture& picture, std::size_t channel);
// The green one.
Estimate radiance_along(const RenderSetup& setup, const Snapshot& snapshot, const Vec3& position,
                        const Vec3& target, int side, int samples);

// What measure(i) gives for i in [0, count), in order. A small picture is one tile and keeps one core busy,
// so many of them are taken side by side.
template <class Measure>
auto side_by_side(std::size_t count, const Measure& measure) {
  std::vector<decltype(measure(count))> seen(count);
  parallel_for(count, 1, [&](std::size_t i) { seen[i] = measure(i); });
  return seen;
}

// Distances from expectation in standard deviations. They pass if none is beyond 4.5, at most 1 % (and one)
// beyond 3, and their root mean square is near 1, neither biased nor suspiciously quiet: within 0.8 to 1.2 if
// there are enough of them for that to be sure.
class Scores {
 public:
  void add(double measured, double expected, double error) { z_.push_back((measured - expected) / error); }
  std::size_t size() const { return z_.size(); }
  double rms() const;
  double largest() const;
  std::size_t beyond(double z) const;

 private:
  std::vector<double> z_;
};
void require_unbiased(const Scores& scores);

}  // namespace firn::test
