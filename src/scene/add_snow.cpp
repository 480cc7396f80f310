// SPDX-License-Identifier: MIT
#include "src/scene/add_snow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "firn/error.h"
#include "src/core/parallel.h"
#include "src/scene/place_particles.h"
#include "src/scene/place_points.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

Bounds bounds_of(const std::vector<Vec3>& points, double margin) {
  Bounds bounds;
  for (const Vec3& p : points) bounds.include(p);
  bounds.min -= Vec3::Constant(margin);
  bounds.max += Vec3::Constant(margin);
  return bounds;
}

// The snow that is there already, in cells as wide as the distance that is asked for: a point has to look at
// 27 of them.
class Neighbours {
 public:
  Neighbours(const Snapshot& snow, const Bounds& bounds, double distance) : distance_(distance) {
    for (std::size_t i = 0; i < snow.size(); ++i) {
      const Vec3 p = vec(snow.world_position(i));
      if ((p.array() < bounds.min.array()).any() || (p.array() > bounds.max.array()).any()) continue;
      cells_[cell(p)].push_back(p);
    }
  }
  bool is_near(const Vec3& p) const {
    const auto home = cell(p);
    for (int n = 0; n < 27; ++n) {
      const auto found = cells_.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
      if (found == cells_.end()) continue;
      for (const Vec3& q : found->second) {
        if ((p - q).norm() < distance_) return true;
      }
    }
    return false;
  }

 private:
  using Cell = std::array<long, 3>;
  Cell cell(const Vec3& p) const {
    return {std::lround(std::floor(p.x() / distance_)), std::lround(std::floor(p.y() / distance_)),
            std::lround(std::floor(p.z() / distance_))};
  }
  double distance_;
  std::map<Cell, std::vector<Vec3>> cells_;
};

using Marks = std::vector<unsigned char>;  // one a particle

Marks near_snow(const PlacedSnow& snow, const Snapshot& other, double distance) {
  const Neighbours there(other, bounds_of(snow.position, distance), distance);
  Marks marks(snow.position.size());
  parallel_for(marks.size(), 1024, [&](std::size_t i) { marks[i] = there.is_near(snow.position[i]); });
  return marks;
}

Marks inside(const PlacedSnow& snow, const Shape& shape, double depth) {
  Marks marks(snow.position.size());
  parallel_for(marks.size(), 1024,
               [&](std::size_t i) { marks[i] = signed_distance(shape, snow.position[i]) < -depth; });
  return marks;
}

std::ptrdiff_t count(const Marks& marks) { return std::count(marks.begin(), marks.end(), 1); }

void trim(const SceneConfig& scene, std::size_t index, PlacedSnow& snow, const Surroundings& there,
          double spacing) {
  leave_out(snow, near_snow(snow, there.snow, spacing));
  for (const Collider& collider : there.colliders) leave_out(snow, inside(snow, collider.shape, 0));
  if (snow.position.empty()) {
    throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index), "trim"),
                "all of snow '" + snow.name + "' lies inside other bodies: 'trim' leaves nothing of it");
  }
}

void refuse_overlaps(const SceneConfig& scene, std::size_t index, const PlacedSnow& snow,
                     const Surroundings& there, double spacing) {
  std::string found;
  const auto note = [&](const Marks& marks, const std::string& what) {
    const auto particles = count(marks);
    if (particles == 0) return;
    found += (found.empty() ? "snow '" + snow.name + "' would start inside " : ", and inside ") + what +
             " (" + std::to_string(particles) + " particles)";
  };
  note(near_snow(snow, there.snow, 0.5 * spacing), "snow that is there already");
  for (const Collider& c : there.colliders)
    note(inside(snow, c.shape, 0.5 * spacing),
         c.name == "ground" ? "the ground" : "collider '" + c.name + "'");
  if (found.empty()) return;
  throw Error(
      ErrorCode::usage, place_of(scene, table_of("snow", index), "center"),
      found + "; move it, set trim = true to leave out what lies inside, or set allow_overlap = true");
}

}  // namespace

PlacedSnow place_among(const SceneConfig& scene, std::size_t index, const Surroundings& there) {
  const SnowConfig& config = scene.snow[index];
  check_waves(scene, index, there.dx);
  PlacedSnow snow;
  double spacing = particle_spacing(there.dx, config.particles_per_cell);
  if (is_points(config)) {
    snow = place_points(scene, index);
    spacing = points_spacing(snow);
  } else {
    const std::vector<Shape> shapes = place_snow(scene, index, 2 * there.dx);
    check_count(scene, {}, {shapes}, {spacing}, there.dx);
    snow = place_particles(scene, index, shapes, spacing);
  }
  loosen(scene, index, snow);
  if (config.trim) {
    trim(scene, index, snow, there, spacing);
  } else if (!config.allow_overlap) {
    refuse_overlaps(scene, index, snow, there, spacing);
  }
  check_domain(scene, index, snow, there.domain);
  return snow;
}

}  // namespace firn
