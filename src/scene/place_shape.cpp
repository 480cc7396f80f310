// SPDX-License-Identifier: MIT
// In: shape keys. Out: Shapes with their files loaded; flakes scattered by dart throwing with a least
// distance.
#include "src/scene/place_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/geometry/height_field.h"
#include "src/geometry/mesh.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

constexpr std::uint64_t kFlakeKey = 0xf1a4e;  // a stream of its own among the random numbers
constexpr double kDegrees = 3.14159265358979323846 / 180;

template <class Load>
auto load_at(const SceneConfig& scene, const std::string& table, Load&& load) {
  try {
    return load();
  } catch (const Error& error) {
    throw Error(error.code(), place_of(scene, table, "file"), error.what());
  }
}

HeightField load_height_field(const ShapeConfig& config, ShapeUse use) {
  auto raster = std::make_shared<HeightRaster>(load_height_raster(*config.file, config.extent));
  const double deep = raster->lowest() - 0.25 * std::max(raster->width(), raster->depth());
  return {raster, config.base.value_or(use == ShapeUse::snow ? 0.0 : deep)};
}

// The cells of a hash grid as wide as the least distance: a new centre has to look at 27 of them.
class Scatter {
 public:
  explicit Scatter(double distance) : distance_(distance) {}

  bool is_free(const Vec3& p) const {
    const auto home = cell(p);
    for (int n = 0; n < 27; ++n) {
      const auto found = cells_.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
      if (found == cells_.end()) continue;
      for (const Vec3& q : found->second) {
        if ((p - q).norm() < distance_) return false;
      }
    }
    return true;
  }
  void add(const Vec3& p) { cells_[cell(p)].push_back(p); }

 private:
  using Cell = std::array<long, 3>;
  Cell cell(const Vec3& p) const {
    return {std::lround(std::floor(p.x() / distance_)), std::lround(std::floor(p.y() / distance_)),
            std::lround(std::floor(p.z() / distance_))};
  }
  double distance_;
  std::map<Cell, std::vector<Vec3>> cells_;
};

std::vector<Shape> scatter_flakes(const SceneConfig& scene, std::size_t index, double gap) {
  constexpr int kTries = 200;  // for one flake, before the region counts as full
  const ShapeConfig& config = scene.snow[index].shape;
  const Vec3 room = (*config.size - Vec3::Constant(2 * *config.radius)).cwiseMax(0.0);
  Scatter scatter(2 * *config.radius + gap);
  std::vector<Shape> flakes;
  for (int i = 0; i < config.count; ++i) {
    int tries = 0;
    Vec3 p;
    do {
      if (tries == kTries) {
        throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index), "count"),
                    "only " + std::to_string(i) + " of " + std::to_string(config.count) +
                        " flakes fit into the region");
      }
      const auto axis = [&](int k) {
        return uniform_double(hash_keys(scene.simulation.seed, kFlakeKey, index, i, tries, k)) - 0.5;
      };
      p = *config.center + Vec3(axis(0), axis(1), axis(2)).cwiseProduct(room);
      ++tries;
    } while (!scatter.is_free(p));
    scatter.add(p);
    flakes.push_back({Ball{*config.radius}, {Mat3::Identity(), p}});
  }
  return flakes;
}

}  // namespace

Mat3 rotation_matrix(const Vec3& degrees) {
  const Vec3 angle = degrees * kDegrees;
  return (Eigen::AngleAxisd(angle.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(angle.y(), Vec3::UnitY()) *
          Eigen::AngleAxisd(angle.x(), Vec3::UnitX()))
      .toRotationMatrix();
}

// The plane's own x axis is the world's where that is possible, so that patterns on it lie straight.
Shape plane_shape(const Vec3& point, const Vec3& normal) {
  const Vec3 y = normal.normalized();
  const Vec3 seed = std::abs(y.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitZ();
  const Vec3 x = (seed - y * y.dot(seed)).normalized();
  Shape shape{HalfSpace{}, {}};
  shape.pose.rotation << x, y, x.cross(y);
  shape.pose.translation = point;
  return shape;
}

Shape place_shape(const SceneConfig& scene, const std::string& table, const ShapeConfig& config,
                  ShapeUse use) {
  if (config.shape == "plane") return plane_shape(*config.point, *config.normal);
  const Pose pose{rotation_matrix(config.rotation), config.center.value_or(config.offset)};
  if (config.shape == "ball") return {Ball{*config.radius}, {Mat3::Identity(), *config.center}};
  if (config.shape == "box") return {Box{0.5 * *config.size}, pose};
  if (config.shape == "cylinder") return {Cylinder{*config.radius, 0.5 * *config.height}, pose};
  if (config.shape == "capsule")
    return {Capsule{*config.radius, 0.5 * *config.height - *config.radius}, pose};
  if (config.shape == "height_field") {
    return {load_at(scene, table, [&] { return load_height_field(config, use); }), pose};
  }
  return {load_at(scene, table,
                  [&] { return Mesh{std::make_shared<TriangleMesh>(load_obj(*config.file, config.scale))}; }),
          pose};
}

Motion place_motion(const ColliderConfig& config, const Shape& shape) {
  if (!config.motion) return {};
  std::vector<MotionKey> keys;
  for (const KeyFrameConfig& key : *config.motion) {
    keys.push_back({key.time, key.position, rotation_matrix(key.rotation)});
  }
  return {std::move(keys), config.pivot.value_or(shape.pose.translation)};
}

std::vector<Shape> place_snow(const SceneConfig& scene, std::size_t index, double gap) {
  const ShapeConfig& config = scene.snow[index].shape;
  if (config.shape == "flakes") return scatter_flakes(scene, index, gap);
  return {place_shape(scene, table_of("snow", index), config, ShapeUse::snow)};
}

}  // namespace firn
