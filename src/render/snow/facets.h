// SPDX-License-Identifier: MIT
// The flat facets of ice that a particle owns: small balls, each with a normal, strewn through the particle's
// own frame without end, of which the snow's surface shows those that it cuts. They are a Poisson process in
// five dimensions, three of place and two of direction, made on demand by hashes of (particle, cell): whoever
// asks about a place and a direction reads the few cells around them, however many facets there are. So the
// set is fixed for ever, any number of facets costs the same, and what is seen in a place is Poisson
// distributed.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "kernels/shade/table.h"
#include "src/core/rng.h"
#include "src/core/vector.h"
#include "src/render/setup.h"

namespace firn {

class FacetField {
 public:
  explicit FacetField(const SparkleSettings& settings);

  float radius() const { return radius_; }  // m, of each ball
  float cell() const { return cell_; }      // m
  // Facet area a m^2 of surface, of those that face outward; times 1 / 2 pi: the microfacet density.
  float coverage() const { return coverage_; }

  // For ShadeKernels::may_glint: facets whose normals fill a cone of this chord, spread along the surface to
  // `widest` m at most.
  kernels::FacetCells cells(float chord, float widest) const {
    return {radius_, cell_, inv_cell_, chord, side_, step_, mean_, none_, widest};
  }

  // Calls visit(place, normal) for all facets of the particle with a place within `box` of `at` (m, its
  // frame) and a normal within the distance `chord` of the unit vector `half`, and for some others.
  template <class Visit>
  void near(std::uint32_t particle, const Vec3f& at, const Vec3f& box, const Vec3f& half, float chord,
            Visit&& visit) const {
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<int>(std::floor((at[a] - box[a]) * inv_cell_));
      high[a] = static_cast<int>(std::floor((at[a] + box[a]) * inv_cell_));
    }
    for (int face = 0; face < 6; ++face) {
      int first[2], last[2];
      if (!cells_of_face(face, half, chord, first, last)) continue;
      for (int i = first[0]; i <= last[0]; ++i) {
        for (int j = first[1]; j <= last[1]; ++j) {
          const std::uint64_t key = mix64(static_cast<std::uint64_t>(particle) << 32 |
                                          static_cast<std::uint64_t>(face) << 24 | i << 12 | j);
          for (int x = low[0]; x <= high[0]; ++x) {
            for (int y = low[1]; y <= high[1]; ++y) {
              for (int z = low[2]; z <= high[2]; ++z) visit_cell(key, face, i, j, x, y, z, visit);
            }
          }
        }
      }
    }
  }

 private:
  // Directions are points of a cube's faces, u, v in [-1, 1], cut into side_ x side_ cells. False: none.
  bool cells_of_face(int face, const Vec3f& half, float chord, int first[2], int last[2]) const;
  // Facets of one cell, of those that are kept: candidates are even over the cube, and one at (u, v) stands
  // for (1 + u^2 + v^2)^(-3/2) as much of the sphere as one in the middle of a face.
  template <class Visit>
  void visit_cell(std::uint64_t key, int face, int i, int j, int x, int y, int z, Visit& visit) const {
    const auto place_bits = [](int k) { return static_cast<std::uint64_t>(k & 0x1fffff); };
    const std::uint64_t bits = mix64(key ^ (place_bits(x) << 42 | place_bits(y) << 21 | place_bits(z)));
    double left = uniform_double(bits), probability = none_;
    for (int count = 1; left >= probability && count < kMostInCell; ++count) {
      left -= probability;
      probability *= mean_ / count;
      visit_candidate(mix64(bits + static_cast<std::uint64_t>(count)), face, i, j, Vec3f(x, y, z), visit);
    }
  }
  template <class Visit>
  void visit_candidate(std::uint64_t bits, int face, int i, int j, const Vec3f& corner, Visit& visit) const {
    const auto part = [](std::uint64_t b, int shift) {
      return static_cast<float>(b >> shift & 0x1fffff) * 0x1p-21f;
    };
    const std::uint64_t more = mix64(bits);
    const float u = (static_cast<float>(i) + part(more, 0)) * step_ - 1;
    const float v = (static_cast<float>(j) + part(more, 21)) * step_ - 1;
    const float shorter = 1 / std::sqrt(1 + u * u + v * v);
    if (part(more, 42) >= shorter * shorter * shorter) return;
    const int axis = face >> 1;
    Vec3f normal;
    normal[axis] = face & 1 ? -shorter : shorter;
    normal[(axis + 1) % 3] = u * shorter;
    normal[(axis + 2) % 3] = v * shorter;
    visit(Vec3f(cell_ * (corner + Vec3f(part(bits, 0), part(bits, 21), part(bits, 42)))), normal);
  }

  static constexpr int kMostInCell = 256;

  float radius_, coverage_;
  float cell_, inv_cell_;  // m, of places
  int side_;               // cells of direction along an edge of the cube
  float step_;             // 2 / side
  double mean_, none_;     // candidates in a cell, and how often there is none
};

}  // namespace firn
