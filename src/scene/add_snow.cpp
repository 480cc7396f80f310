// SPDX-License-Identifier: MIT
#include "src/scene/add_snow.h"

#include <algorithm>
#include <string>
#include <utility>

#include "firn/error.h"
#include "src/core/parallel.h"
#include "src/geometry/point_tree.h"
#include "src/scene/place_particles.h"
#include "src/scene/place_points.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

using Marks = std::vector<unsigned char>;  // one a particle

// Nearer than `distance` (m) to snow that is there already.
Marks near_snow(const PlacedSnow& snow, const Snapshot& other, double distance) {
  Bounds bounds;
  for (const Vec3& p : snow.position) bounds.include(p);
  std::vector<Vec3> there;
  for (std::size_t i = 0; i < other.size(); ++i) {
    const Vec3 p = vec(other.world_position(i));
    const Vec3 beyond = (bounds.min - p).cwiseMax(p - bounds.max);
    if (beyond.maxCoeff() <= distance) there.push_back(p);
  }
  const PointTree tree(std::move(there));
  Marks marks(snow.position.size());
  parallel_for(marks.size(), 1024,
               [&](std::size_t i) { marks[i] = tree.distance(snow.position[i]) < distance; });
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
