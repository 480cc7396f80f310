// SPDX-License-Identifier: MIT
// Normals of the smooth surface: gradients of the fill at the corners, trilinear in between.
#include <algorithm>

#include "src/core/parallel.h"
#include "src/render/snow/snow_field.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kBrickCorners;
using kernels::kCornerSide;
using kernels::kFieldTile;
using kernels::kFieldTileRow;
using kernels::kFieldTileSide;

// From three values in a row: their difference and their sum by 1, 2, 1.
float slope(const float* v, int step) { return v[step] - v[-step]; }
float smooth(const float* v, int step) { return v[-step] + 2 * v[0] + v[step]; }

// Central differences, smoothed across (Sobel), of a tile's values, times 32 cells: first along z, then along
// y, then along x. The tile goes through as one row, which the compiler turns into vectors; what runs over
// the ends of its own rows is not used.
void sobel(const float* tile, float scale, float* out) {
  constexpr int kRow = kFieldTileRow, kPlane = kFieldTileSide * kRow;
  float sz[kFieldTile] = {}, dz[kFieldTile] = {}, ss[kFieldTile], ds[kFieldTile], sd[kFieldTile];
  for (int i = 1; i < kFieldTile - 1; ++i) sz[i] = smooth(tile + i, 1), dz[i] = slope(tile + i, 1);
  for (int i = kRow; i < kFieldTile - kRow; ++i)
    ss[i] = smooth(sz + i, kRow), ds[i] = slope(sz + i, kRow), sd[i] = smooth(dz + i, kRow);
  for (int x = 0; x < kCornerSide; ++x) {
    for (int y = 0; y < kCornerSide; ++y) {
      for (int z = 0; z < kCornerSide; ++z, out += 3) {
        const int i = field_tile_index(x, y, z);
        out[0] = slope(ss + i, kPlane) * scale;
        out[1] = smooth(ds + i, kPlane) * scale;
        out[2] = smooth(sd + i, kPlane) * scale;
      }
    }
  }
}

}  // namespace

// Corners -1 to 5 of a brick, from the bricks that hold them; 0 where none is.
void SnowField::fill_around(std::size_t slot, float* tile) const {
  const auto step_of = [](int at) { return at < 0 ? 0 : at > kBrickCells ? 2 : 1; };
  const auto row_of = [&](int step, int at) { return at - kBrickCells * (step - 1); };
  for (int x = -1; x <= kCornerSide; ++x) {
    for (int y = -1; y <= kCornerSide; ++y) {
      const int i = step_of(x), j = step_of(y);
      const float* row[3] = {};  // along z, of the bricks below, here and above
      for (int k = 0; k < 3; ++k) {
        const std::size_t other = around(slot, 9 * i + 3 * j + k);
        if (other != SIZE_MAX)
          row[k] = &fill_[other * kBrickCorners + corner_index(row_of(i, x), row_of(j, y), 0)];
      }
      float* to = tile + field_tile_index(x, y, -1);
      to[0] = row[0] ? row[0][kBrickCells - 1] : 0;
      for (int z = 0; z < kCornerSide; ++z) to[1 + z] = row[1] ? row[1][z] : 0;
      to[1 + kCornerSide] = row[2] ? row[2][1] : 0;
      to[2 + kCornerSide] = 0;
    }
  }
}

// At the corners of the bricks that the surface crosses.
void SnowField::measure_gradients() {
  const std::size_t slots = grid_->brick_of_slot().size();
  gradient_at_.resize(slots);
  std::uint32_t crossed = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    std::uint32_t any = 0;
    for (std::size_t w = 0; w < 8; ++w) any |= kind_[slot * 8 + w] & 0x11111111u;
    gradient_at_[slot] = any != 0 ? crossed++ : kNone;
  }
  gradient_.resize(static_cast<std::size_t>(crossed) * 3 * kBrickCorners);
  const float scale = grid_->view().inv_cell / 32;
  parallel_for(slots, 16, [&](std::size_t slot) {
    if (gradient_at_[slot] == kNone) return;
    float tile[kFieldTile];
    fill_around(slot, tile);
    sobel(tile, scale, &gradient_[static_cast<std::size_t>(gradient_at_[slot]) * 3 * kBrickCorners]);
  });
}

Vec3f SnowField::normal(const Vec3f& p, const Vec3f& otherwise) const {
  Place place;
  if (!find(p, place) || gradient_at_[place.slot] == kNone) return otherwise;
  const float* corner = &gradient_[(static_cast<std::size_t>(gradient_at_[place.slot]) * kBrickCorners +
                                    corner_index(place.cell[0], place.cell[1], place.cell[2])) *
                                   3];
  Vec3f sum = Vec3f::Zero();
  for (int k = 0; k < 8; ++k) {
    const int x = k >> 2, y = k >> 1 & 1, z = k & 1;
    const float weight = (x ? place.part[0] : 1 - place.part[0]) * (y ? place.part[1] : 1 - place.part[1]) *
                         (z ? place.part[2] : 1 - place.part[2]);
    const float* g = corner + 3 * corner_index(x, y, z);
    sum -= weight * Vec3f(g[0], g[1], g[2]);
  }
  const float length = sum.norm();
  return length > 1e-12f ? Vec3f(sum / length) : otherwise;
}

}  // namespace firn
