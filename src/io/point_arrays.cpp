// SPDX-License-Identifier: MIT
#include "src/io/point_arrays.h"

#include <utility>

#include "firn/error.h"
#include "src/core/text.h"
#include "src/io/file.h"
#include "src/io/npy.h"
#include "src/io/point_file.h"

namespace firn {
namespace {

// A column of `count` entries, or none; or one for all, where `one` says so.
void require_length(const std::string& where, const char* column, std::size_t entries, std::size_t count,
                    bool one = false) {
  if (entries == 0 || entries == count || (one && entries == 1)) return;
  throw Error(ErrorCode::usage, where,
              std::string("'") + column + "' has " + grouped(entries) + " entries, and there are " +
                  grouped(count) + " positions" + (one ? ": expected one a point, or one for all" : ""));
}

std::vector<double> numbers(const std::string& where, const char* column, const std::vector<double>& values,
                            std::size_t count) {
  require_length(where, column, values.size(), count, true);
  return values.size() == 1 ? std::vector<double>(count, values[0]) : values;
}

std::vector<Vec3> vectors(const std::string& where, const char* column, const std::vector<Vector3>& values,
                          std::size_t count) {
  require_length(where, column, values.size(), count);
  std::vector<Vec3> out;
  out.reserve(values.size());
  for (const Vector3& v : values) out.push_back(vec(v));
  return out;
}

}  // namespace

PointCloud cloud_of(const Points& points, const std::string& where) {
  const std::size_t count = points.position.size();
  PointCloud cloud;
  cloud.position = vectors(where, "position", points.position, count);
  cloud.velocity = vectors(where, "velocity", points.velocity, count);
  cloud.volume = numbers(where, "volume", points.volume, count);
  cloud.mass = numbers(where, "mass", points.mass, count);
  cloud.radius = numbers(where, "radius", points.radius, count);
  cloud.density = numbers(where, "density", points.density, count);
  cloud.packing = numbers(where, "Jp", points.Jp, count);
  require_length(where, "F", points.F.size(), count);
  for (const Matrix3& f : points.F) cloud.strain.push_back(mat(f).cast<float>());
  try {
    require_sound(cloud, "points");
  } catch (const Error& error) {
    throw Error(ErrorCode::usage, where, error.what());
  }
  return cloud;
}

Points read_points(const std::string& file) {
  PointCloud cloud = read_point_file(file);
  Points points;
  for (const Vec3& p : cloud.position) points.position.push_back(array_of(p));
  for (const Vec3& v : cloud.velocity) points.velocity.push_back(array_of(v));
  for (const Eigen::Matrix3f& f : cloud.strain) points.F.push_back(rows_of(f.cast<double>()));
  points.volume = std::move(cloud.volume);
  points.mass = std::move(cloud.mass);
  points.radius = std::move(cloud.radius);
  points.density = std::move(cloud.density);
  points.Jp = std::move(cloud.packing);
  return points;
}

void write_points(const Points& points, const std::string& file) {
  write_file(replaceable(file), encode_npz(cloud_of(points, file)));
}

}  // namespace firn
