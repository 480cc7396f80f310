// SPDX-License-Identifier: MIT
// In: a file of points and the keys of its shape. Out: placed snow. What has a length is in the file's unit
// and is scaled; kilograms are not.
#include "src/scene/place_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include "firn/error.h"
#include "src/io/point_file.h"
#include "src/scene/name.h"
#include "src/scene/place_shape.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// A point of a file, and what is wrong with it for this snow.
[[noreturn]] void refuse_file(const SceneConfig& scene, std::size_t index, const std::string& what) {
  throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index), "file"), what);
}

PointCloud load_cloud(const SceneConfig& scene, std::size_t index) {
  if (const auto& points = scene.snow[index].shape.points) return *points;
  if (names_arrays(*scene.snow[index].shape.file)) {
    refuse_file(scene, index,
                "these points were arrays of the program that made the scene: write them to a file "
                "(firn::write_points, numpy.savez) and name that");
  }
  try {
    return read_point_file(*scene.snow[index].shape.file);
  } catch (const Error& error) {
    throw Error(error.code(), place_of(scene, table_of("snow", index), "file"), error.what());
  }
}

// m^3 of each point as the file says it: its volume, or else its mass, or else its radius. Empty: it says
// none.
std::vector<double> told_volumes(const PointCloud& cloud, double scale, double density) {
  std::vector<double> volumes = cloud.volume;
  for (double& v : volumes) v *= scale * scale * scale;
  if (!volumes.empty()) return volumes;
  for (const double mass : cloud.mass) volumes.push_back(mass / density);
  if (!volumes.empty()) return volumes;
  for (const double radius : cloud.radius) volumes.push_back(std::pow(2 * radius * scale, 3));
  return volumes;
}

// One volume for all where they are the same.
void set_volumes(PlacedSnow& snow, std::vector<double> volumes) {
  const bool even = std::all_of(volumes.begin(), volumes.end(), [&](double v) { return v == volumes[0]; });
  snow.particle_volume =
      even ? volumes[0]
           : std::accumulate(volumes.begin(), volumes.end(), 0.0) / static_cast<double>(volumes.size());
  if (!even) snow.volume = std::move(volumes);
}

void find_volumes(const SceneConfig& scene, std::size_t index, const PointCloud& cloud, PlacedSnow& snow) {
  const ShapeConfig& shape = scene.snow[index].shape;
  if (shape.spacing) {
    snow.particle_volume = std::pow(*shape.spacing, 3);
    return;
  }
  std::vector<double> volumes = told_volumes(cloud, shape.scale, snow.material.density);
  if (!volumes.empty()) return set_volumes(snow, std::move(volumes));
  snow.particle_volume = volume_of_point(PointTree(snow.position));
  if (snow.particle_volume > 0) return;
  refuse_file(
      scene, index,
      snow.position.size() == 1
          ? "the file's one point does not tell how much snow it stands for: set 'spacing', in metres"
          : "most of the file's points lie at the same place, so they do not tell how much snow each stands "
            "for: set 'spacing', in metres");
}

// Masses and stresses of such particles are normal floats.
void check_volumes(const SceneConfig& scene, std::size_t index, const PlacedSnow& snow) {
  constexpr double kLeast = 1e-33, kGreatest = 1e33;  // kg, m^3
  const auto sound = [&](double x) { return x >= kLeast && x <= kGreatest; };
  for (std::size_t i = 0; i < std::max<std::size_t>(snow.volume.size(), 1); ++i) {
    const double volume = snow.volume_of(i);
    if (sound(volume) && sound(volume * snow.material.density)) continue;
    char text[160];
    std::snprintf(
        text, sizeof text,
        "point %zu, counted from 0, stands for %.3g m3, which single precision cannot calculate with", i,
        volume);
    refuse_file(scene, index, text);
  }
}

// Jp: as the file says it, or else what makes the snow as dense as the file says.
void find_packing(const SceneConfig& scene, std::size_t index, const PointCloud& cloud, PlacedSnow& snow) {
  const Material& material = snow.material;
  std::vector<double> packing = cloud.packing;
  if (packing.empty()) {
    for (const double density : cloud.density) packing.push_back(material.density / density);
  }
  for (std::size_t i = 0; i < packing.size(); ++i) {
    const double size = std::abs(packing[i]);
    if (size >= material.jp_min && size <= material.jp_max) continue;
    char text[200];
    std::snprintf(
        text, sizeof text,
        "point %zu, counted from 0, has Jp = %.4g%s, outside of this snow's jp_min %.4g to jp_max %.4g", i,
        packing[i], cloud.packing.empty() ? " by its density" : "", material.jp_min, material.jp_max);
    refuse_file(scene, index, text);
  }
  snow.packing.assign(packing.begin(), packing.end());
}

// The file's frame is scaled, then turned, then moved.
void move_into_world(const SnowConfig& config, PointCloud& cloud, PlacedSnow& snow) {
  const Pose pose{rotation_matrix(config.shape.rotation), config.shape.offset};
  const double scale = config.shape.scale;
  Bounds bounds;
  snow.position = std::move(cloud.position);
  for (Vec3& p : snow.position) {
    p = pose.to_world(scale * p);
    bounds.include(p);
  }
  snow.velocity = std::move(cloud.velocity);
  snow.velocity.resize(snow.position.size(), Vec3::Zero());
  for (std::size_t i = 0; i < snow.velocity.size(); ++i) {
    snow.velocity[i] = config.velocity + config.spin.cross(snow.position[i] - bounds.center()) +
                       pose.rotation * (scale * snow.velocity[i]);
  }
  snow.strain = std::move(cloud.strain);
  for (Eigen::Matrix3f& F : snow.strain)
    F = (pose.rotation * F.cast<double>() * pose.rotation.transpose()).cast<float>();
}

}  // namespace

PlacedSnow place_points(const SceneConfig& scene, std::size_t index) {
  const SnowConfig& config = scene.snow[index];
  PointCloud cloud = load_cloud(scene, index);
  PlacedSnow snow;
  snow.name = config.name;
  snow.material = config.material;
  snow.terminal_velocity = config.terminal_velocity;
  move_into_world(config, cloud, snow);
  find_volumes(scene, index, cloud, snow);
  check_volumes(scene, index, snow);
  find_packing(scene, index, cloud, snow);
  return snow;
}

std::vector<PlacedSnow> place_all_points(const SceneConfig& scene) {
  std::vector<PlacedSnow> all(scene.snow.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_points(scene.snow[i])) all[i] = place_points(scene, i);
  }
  return all;
}

double points_spacing(const PlacedSnow& points) { return std::cbrt(points.particle_volume); }

}  // namespace firn
