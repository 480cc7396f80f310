// SPDX-License-Identifier: MIT
// Homogeneous media in convex shapes: fog in a box, a ball of milk, a slab without end. Their boundary is
// matched: rays go straight on. Where they overlap one another or snow, their coefficients add. Free flights
// are exact exponentials; a channel of the three is chosen for each flight and the others are weighted by the
// balance of all three (single-sample spectral importance sampling), so that grey media bring no noise of
// colour.
#pragma once
#include <cstdint>
#include <vector>

#include "src/render/setup.h"

namespace firn {

class MediumSet {
 public:
  // A usage Error for a shape that is not convex and analytic, or a coefficient that is negative.
  explicit MediumSet(std::vector<Medium> media);

  // Render space is world space minus `origin`.
  void place(const Vec3& origin);
  bool empty() const { return media_.empty(); }
  const Medium& operator[](int medium) const { return media_[medium]; }

  // Up to the first collision before `reach`; every medium draws for itself, by hashes of `key`, and the
  // nearest counts.
  struct Flight {
    int medium = -1;  // it collides in; -1: it goes unhindered
    float t = 0;      // m
    Vec3f weight;     // throughput by density
  };
  Flight fly(const Vec3f& o, const Vec3f& d, float reach, std::uint64_t key) const;

  Vec3f transmittance(const Vec3f& o, const Vec3f& d, float reach) const;

 private:
  std::vector<Medium> media_;
  std::vector<Pose> pose_;  // render space
};

}  // namespace firn
