// SPDX-License-Identifier: MIT
#include "src/io/point_file.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "firn/error.h"
#include "src/core/memory.h"
#include "src/core/text.h"
#include "src/io/file.h"
#include "src/io/npy.h"
#include "src/io/particle_file.h"
#include "src/io/ply.h"

namespace firn {
namespace {

constexpr double kBytesPerPoint = 250;  // as a particle, at the least
// Masses and stresses of such points are normal floats.
constexpr double kLeastValue = 1e-33, kGreatestValue = 1e33, kFarthest = 1e11;

[[noreturn]] void refuse_points(const std::string& where, const std::string& what) {
  throw Error(ErrorCode::io, where, what);
}

[[noreturn]] void refuse_point(const std::string& where, std::size_t index, const char* column,
                               const std::string& what) {
  refuse_points(where, "point " + std::to_string(index) + ", counted from 0: '" + column + "' " + what);
}

std::string number_text(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

void require_places(const std::string& where, const char* column, const std::vector<Vec3>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i].cwiseAbs().maxCoeff() <= kFarthest && values[i].allFinite()) continue;
    std::string text;
    for (const double x : values[i]) text += (text.empty() ? "(" : ", ") + number_text(x);
    refuse_point(where, i, column,
                 "is " + text + (values[i].allFinite() ? "), beyond all sense" : "), which is not finite"));
  }
}

// `both_signs`: a Jp below 0 is that of a layer that has collapsed.
void require_sizes(const std::string& where, const char* column, const std::vector<double>& values,
                   bool both_signs = false) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double size = both_signs ? std::abs(values[i]) : values[i];
    if (size >= kLeastValue && size <= kGreatestValue) continue;
    refuse_point(where, i, column, "is " + number_text(values[i]) + ": it must be above 0 and finite");
  }
}

void require_strains(const std::string& where, const std::vector<Eigen::Matrix3f>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double volume = values[i].cast<double>().determinant();
    if (values[i].allFinite() && volume > 1e-6 && volume < 1e6) continue;
    refuse_point(where, i, "F", "has the determinant " + number_text(volume) + ": it must be near 1");
  }
}

PointCloud points_of(const Snapshot& snapshot) {
  PointCloud cloud;
  for (std::size_t i = 0; i < snapshot.size(); ++i) {
    cloud.position.push_back(vec(snapshot.world_position(i)));
    cloud.velocity.emplace_back(snapshot.velocity[0][i], snapshot.velocity[1][i], snapshot.velocity[2][i]);
    cloud.volume.push_back(snapshot.volume0[i]);
    cloud.density.push_back(snapshot.density[i]);
  }
  return cloud;
}

PointCloud decode_by_mark(std::string_view bytes, const std::string& where) {
  if (bytes.starts_with("ply")) return decode_ply(bytes, where);
  if (bytes.starts_with("PK")) return decode_npz(bytes, where);
  if (bytes.starts_with("\x93NUMPY")) return decode_npy(bytes, where);
  if (bytes.starts_with("FIRNSNAP")) return points_of(decode_snapshot(bytes, where));
  if (bytes.substr(0, 4) == " BDV" || lower_case(where).ends_with(".vdb"))
    refuse_points(where, "OpenVDB is not read: save its points as .npz, .npy or .ply");
  refuse_points(where,
                "holds points in no format that is read: these are .npz and .npy of NumPy, .ply, and "
                "firn's own particle files");
}

}  // namespace

void require_sound(const PointCloud& cloud, const std::string& where) {
  if (cloud.size() == 0) refuse_points(where, "holds no points");
  const double bytes = kBytesPerPoint * static_cast<double>(cloud.size());
  if (bytes > static_cast<double>(machine_memory()) || cloud.size() >= UINT32_MAX)
    refuse_points(where, "holds " + std::to_string(cloud.size()) + " points, which need some " +
                             number_text(bytes / kBytesPerGibibyte) + " GiB: more than this machine has");
  require_places(where, "position", cloud.position);
  require_places(where, "velocity", cloud.velocity);
  require_sizes(where, "volume", cloud.volume);
  require_sizes(where, "mass", cloud.mass);
  require_sizes(where, "radius", cloud.radius);
  require_sizes(where, "density", cloud.density);
  require_sizes(where, "Jp", cloud.packing, true);
  require_strains(where, cloud.strain);
}

PointCloud decode_points(std::string_view bytes, const std::string& where) {
  PointCloud cloud = decode_by_mark(bytes, where);
  require_sound(cloud, where);
  return cloud;
}

PointCloud read_point_file(const std::string& path) { return decode_points(read_file(path), path); }

}  // namespace firn
