// SPDX-License-Identifier: MIT
#include "src/render/snow/facets.h"

#include <numbers>

#include "src/core/portable_math.h"

namespace firn {
namespace {

constexpr double kCandidates = 0.25;  // a cell, about: most cells are empty and cost one hash
constexpr int kMostCells = 1024;      // of direction along an edge

}  // namespace

FacetField::FacetField(const SparkleSettings& s) {
  // A plane cuts `per_volume * 2 radius` balls a m^2, and of each 2/3 of its largest disc in the mean.
  radius_ = static_cast<float>(s.size);
  coverage_ = static_cast<float>(s.density * 2 / 3 * std::numbers::pi * s.size * s.size);
  const double per_volume = s.density / (2 * s.size);
  // A cell is about 2 roughness wide.
  side_ = std::clamp(static_cast<int>(180 / std::numbers::pi / s.roughness), 1, kMostCells);
  step_ = 2.f / static_cast<float>(side_);
  const double per_cell = per_volume / (2 * std::numbers::pi) * step_ * step_;  // candidates a m^3
  const double cell = std::max(portable_cbrt(kCandidates / std::max(per_cell, 1e-9)), 2 * s.size);
  cell_ = static_cast<float>(cell);
  inv_cell_ = static_cast<float>(1 / cell);
  mean_ = per_cell * cell * cell * cell;
  none_ = portable_exp(-mean_);
}

// A normal m of the face has m_axis >= 1/sqrt 3, and u = m_a / m_axis.
bool FacetField::cells_of_face(int face, const Vec3f& half, float chord, int first[2], int last[2]) const {
  const int axis = face >> 1;
  const float along = face & 1 ? -half[axis] : half[axis];
  const float most = along + chord, least = std::max(along - chord, 0.577f);
  if (most < least) return false;
  for (int k = 0; k < 2; ++k) {
    const float across = half[(axis + 1 + k) % 3];
    const float low = across - chord, high = across + chord;
    const float u0 = low / (low < 0 ? least : most), u1 = high / (high < 0 ? most : least);
    if (u0 > 1 || u1 < -1) return false;
    first[k] = std::max(static_cast<int>((u0 + 1) / step_), 0);
    last[k] = std::min(static_cast<int>((std::min(u1, 1.f) + 1) / step_), side_ - 1);
  }
  return true;
}

}  // namespace firn
