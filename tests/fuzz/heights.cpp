// SPDX-License-Identifier: MIT
// Each input with and without an extent: an ASCII grid is scaled by the one and taken as it stands without.
#include "src/geometry/height_field.h"

#include <cmath>
#include <optional>

#include "firn/error.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

void read(const std::string& path, const std::optional<Vec3>& extent) {
  try {
    const HeightRaster raster = load_height_raster(path, extent);
    require(raster.columns() >= 2 && raster.rows() >= 2, "a raster has at least two columns and rows");
    require(std::isfinite(raster.width()) && std::isfinite(raster.depth()), "a raster has a size");
    for (int k = 0; k < raster.columns() * raster.rows(); ++k) {
      require(std::isfinite(raster.node(k % raster.columns(), k / raster.columns())), "a height is a number");
    }
    for (const double place : {-1e9, -0.3, 0.0, 0.4, 1e9}) raster.sample(place, -place);
    // Takes 64 samples a cell: only of small ones.
    if (raster.columns() < 64 && raster.rows() < 64) raster.volume_above(0.1);
  } catch (const Error&) {
  }
}

}  // namespace

void heights(std::string_view input) {
  const MemoryFile file(input);
  read(file.path(), Vec3(4, 1, 3));
  read(file.path(), std::nullopt);
}

}  // namespace firn::fuzz
