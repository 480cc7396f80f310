// SPDX-License-Identifier: MIT
// Multiple importance sampling over all ways to sample one path (Veach 1997, chapters 9 and 10): a path of n
// vertices can be found with s of them sampled from a light and n - s from the camera. Densities p_s of
// neighbouring ways differ in one vertex, so their ratios multiply up along a subpath. The weight of a way is
// p_s^2 / sum p_i^2 (the power heuristic).
//
// Densities are per area at surfaces and per volume in media, there without the factors that cancel:
// extinction at the vertex, and the transmittance of edges. Leaving the latter out is no approximation of the
// result, since any weights that sum to one will do; and it is the right choice where visibility through a
// medium is a yes or no of delta tracking, because then every way succeeds as often on the same edge.
#pragma once
#include <algorithm>

namespace firn {

inline constexpr int kMostLightVertices = 16;

// What a subpath must remember so that the sum of the other ways can be formed at its end: for each vertex
// the density with which it was sampled and the one with which the other subpath would sample it, and whether
// the two subpaths can meet at the edge before it.
class Trail {
 public:
  // The subpath arrives at a vertex that it samples with `density`. `back`: turns a density per solid angle
  // at this vertex into one at the vertex before (cosine there / distance^2; 1 for a light at infinity).
  // `meets`: how the edge between the two counts as one where the subpaths meet: 0 if they cannot, else
  // usually 1.
  void arrive(float density, float back, float meets) {
    before_ = last_;
    last_ = {density, meets};
    back_ = back;
    ++arrived_;
  }

  // It leaves the last vertex; `reverse`: the density per solid angle with which the other subpath, coming
  // the same way, goes on to the vertex before.
  void leave(float reverse) {
    if (arrived_ < 2) return;
    ratio_[links_ % kMostLightVertices] = reverse * back_ / before_.density;
    meets_[links_ % kMostLightVertices] = before_.meets;
    ++links_;
  }

  // The sum over the `ways` ways that give the last 1, 2, ... vertices to the other subpath, of the squares
  // of their densities over that of the present way. `density`: with which the other subpath samples the last
  // vertex; `reverse` as in leave().
  double others(float density, float reverse, int ways) const {
    if (ways < 1 || arrived_ < 1) return 0;
    double product = square(density / last_.density), sum = product * square(last_.meets);
    if (ways < 2 || arrived_ < 2) return sum;
    product *= square(reverse * back_ / before_.density);
    sum += product * square(before_.meets);
    const int most = std::min({ways - 2, links_, kMostLightVertices});
    for (int k = 0; k < most; ++k) {
      const int at = (links_ - 1 - k) % kMostLightVertices;
      product *= square(ratio_[at]);
      sum += product * square(meets_[at]);
    }
    return sum;
  }

  float back() const { return back_; }
  float density() const { return last_.density; }

 private:
  struct Link {
    float density = 1, meets = 0;
  };
  static double square(double x) { return x * x; }

  Link before_, last_;
  float back_ = 0;
  int arrived_ = 0, links_ = 0;
  float ratio_[kMostLightVertices], meets_[kMostLightVertices];
};

}  // namespace firn
