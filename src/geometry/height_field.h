// SPDX-License-Identifier: MIT
// A terrain or a snow cover as heights on a regular raster: read from a picture (PGM) or a text raster (ESRI
// ASCII grid), asked for bilinear heights. Local frame: the rectangle is centred on the origin, columns run
// along +X, rows along +Z (the first row of the file is the far one, at -Z), heights are along +Y.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "src/core/vector.h"

namespace firn {

struct HeightSample {
  double height;            // m
  double slope_x, slope_z;  // dh/dx, dh/dz
};

class HeightRaster {
 public:
  // `heights` (m) row by row; the outer samples lie on the rectangle's border. Precondition: columns, rows
  // >= 2.
  HeightRaster(int columns, int rows, std::vector<double> heights, double width, double depth);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  double width() const { return width_; }  // m, along x
  double depth() const { return depth_; }  // m, along z
  double lowest() const { return lowest_; }
  double highest() const { return highest_; }
  double node(int column, int row) const {
    return heights_[static_cast<std::size_t>(row) * columns_ + column];
  }
  // Bilinear; outside the rectangle the value of the nearest border point.
  HeightSample sample(double x, double z) const;
  double volume_above(
      double base) const;  // m^3 between `base` and the surface, where the surface is above it

 private:
  int columns_, rows_;
  std::vector<double> heights_;
  double width_, depth_;
  double lowest_, highest_;
};

// PGM (P2, P5; 8 or 16 bit): 0..maxval becomes 0..extent.y. ESRI ASCII grid: heights and cell size are metres
// as they stand; with an extent, lowest..highest becomes 0..extent.y. `extent` is width (x), height range
// (y), depth (z) in m and is required for a PGM. Errors: io Error for a file that is missing or not
// understood, usage Error for a missing extent.
HeightRaster load_height_raster(const std::string& path, const std::optional<Vec3>& extent);

}  // namespace firn
