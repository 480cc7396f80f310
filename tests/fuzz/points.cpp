// SPDX-License-Identifier: MIT
// The law: what is read has columns of one length and is finite, so that a volume can be found for it.
#include <cmath>

#include "src/io/point_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

template <class Column>
void require_column(const Column& column, std::size_t count) {
  require(column.empty() || column.size() == count, "a column has an entry for every point");
}

}  // namespace

void points(std::string_view input) {
  PointCloud cloud = decode_points(input, "input");
  require(cloud.size() > 0, "a file without points is refused");
  require_column(cloud.velocity, cloud.size());
  require_column(cloud.volume, cloud.size());
  require_column(cloud.mass, cloud.size());
  require_column(cloud.radius, cloud.size());
  require_column(cloud.density, cloud.size());
  require_column(cloud.packing, cloud.size());
  require_column(cloud.strain, cloud.size());
  for (const Vec3& p : cloud.position) require(p.allFinite(), "a point has a place");
  for (const double volume : cloud.volume) require(volume > 0 && std::isfinite(volume), "a volume is a size");
  require(std::isfinite(volume_of_point(PointTree(std::move(cloud.position)))), "points have room");
}

}  // namespace firn::fuzz
