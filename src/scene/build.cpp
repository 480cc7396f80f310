// SPDX-License-Identifier: MIT
// In: a SceneConfig. Out: what the simulation is told. Particles are placed, files loaded, starts that
// overlap refused.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "firn/error.h"
#include "src/particles/blocks.h"
#include "src/scene/emit.h"
#include "src/scene/overlaps.h"
#include "src/scene/place_particles.h"
#include "src/scene/place_points.h"
#include "src/scene/place_shape.h"
#include "src/scene/scene.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// m; the narrowest side of a snow object's bounds in its own frame.
double narrowest(const SceneConfig& scene, std::size_t index) {
  const ShapeConfig& config = scene.snow[index].shape;
  if (config.shape == "flakes") return 2 * *config.radius;
  const Shape shape = place_shape(scene, table_of("snow", index), config, ShapeUse::snow);
  return world_bounds({shape.form, Pose{}}).size().minCoeff();
}

void place_colliders(const SceneConfig& scene, SolverSetup& setup) {
  if (scene.ground) {
    setup.colliders.push_back({"ground",
                               plane_shape(Vec3(0, scene.ground->height, 0), Vec3::UnitY()),
                               scene.ground->contact,
                               scene.ground->friction,
                               scene.ground->static_friction,
                               {}});
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const ColliderConfig& c = scene.colliders[i];
    const Shape shape = place_shape(scene, table_of("collider", i), c.shape, ShapeUse::solid);
    setup.colliders.push_back(
        {c.name, shape, c.contact, c.friction, c.static_friction, place_motion(c, shape)});
  }
}

// Before the simulation says it of all snow alike: maps have coordinates that are far from 0.
void check_reach(const SceneConfig& scene, const SolverSetup& setup) {
  const double reach = 4.0 * kBlockReach * setup.dx;
  for (std::size_t i = 0; i < setup.snow.size() && !setup.frame; ++i) {
    if (!is_points(scene.snow[i])) continue;
    Bounds bounds;
    for (const Vec3& p : setup.snow[i].position) bounds.include(p);
    const double farthest = std::max(bounds.max.maxCoeff(), -bounds.min.minCoeff());
    if (farthest < 0.99 * reach) continue;
    const double grain = std::pow(10, std::floor(std::log10(0.1 * reach)));
    Vec3 offset = (scene.snow[i].shape.offset - bounds.center()) / grain;
    offset = grain * (offset.array().round() + 0.0);  // no -0
    char text[400];
    std::snprintf(
        text, sizeof text,
        "the points of this snow reach %.3g m from the origin, the grid %.3g m at dx = %.3g m: move "
        "them, as with offset = [%.12g, %.12g, %.12g]",
        farthest, reach, setup.dx, offset.x(), offset.y(), offset.z());
    throw Error(ErrorCode::usage, place_of(scene, table_of("snow", i), "offset"), text);
  }
}

void check_fixed_dt(const SceneConfig& scene, double dx) {
  double bound = 1e300;
  std::string name;
  for (const SnowConfig& snow : scene.snow) {
    if (stable_dt(snow.material, dx) < bound) name = snow.name;
    bound = std::min(bound, stable_dt(snow.material, dx));
  }
  if (*scene.simulation.dt <= bound) return;
  char text[160];
  std::snprintf(text, sizeof text, "dt = %.3g s is above the stable bound %.3g s of snow '",
                *scene.simulation.dt, bound);
  throw Error(ErrorCode::usage, place_of(scene, "simulation", "dt"),
              text + name + "'; leave it to dt = \"auto\", or insist with --force");
}

// Points cannot be placed more densely for a finer grid: the coarsest of them say what it is.
double grid_spacing_for(const SceneConfig& scene, const std::vector<PlacedSnow>& points) {
  if (scene.simulation.dx) return *scene.simulation.dx;
  double for_points = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].position.empty()) continue;
    for_points =
        std::max(for_points, points_spacing(points[i]) * std::cbrt(scene.snow[i].particles_per_cell));
  }
  if (for_points > 0) return for_points;
  const int across = *scene.simulation.particles_across;
  double dx = 1e300;
  for (std::size_t i = 0; i < scene.snow.size(); ++i) {
    dx = std::min(dx, narrowest(scene, i) / across * std::cbrt(scene.snow[i].particles_per_cell));
  }
  return dx;
}

}  // namespace

std::optional<Shape> domain_of(const SceneConfig& scene) {
  const SimulationConfig& config = scene.simulation;
  if (!config.domain_min) return std::nullopt;
  return Shape{Box{0.5 * (*config.domain_max - *config.domain_min)},
               {rotation_matrix(config.domain_rotation), 0.5 * (*config.domain_min + *config.domain_max)}};
}

double grid_spacing(const SceneConfig& scene) {
  if (scene.simulation.dx) return *scene.simulation.dx;
  return grid_spacing_for(scene, place_all_points(scene));
}

SolverSetup build_simulation(const SceneConfig& scene, bool force) {
  SolverSetup setup;
  std::vector<PlacedSnow> points = place_all_points(scene);
  setup.dx = grid_spacing_for(scene, points);
  setup.gravity = scene.simulation.gravity;
  setup.fixed_dt = scene.simulation.dt;
  setup.domain = domain_of(scene);
  if (setup.domain && !scene.simulation.domain_rotation.isZero(0)) setup.frame = setup.domain->pose;
  setup.sleep = scene.simulation.sleep;
  for (std::size_t i = 0; i < scene.snow.size(); ++i) check_waves(scene, i, setup.dx);
  if (setup.fixed_dt && !force) check_fixed_dt(scene, setup.dx);
  place_colliders(scene, setup);
  std::vector<std::vector<Shape>> shapes;
  std::vector<double> spacing;
  for (std::size_t i = 0; i < scene.snow.size(); ++i) {
    const bool of_points = is_points(scene.snow[i]);
    shapes.push_back(of_points ? std::vector<Shape>() : place_snow(scene, i, 2 * setup.dx));
    spacing.push_back(of_points ? points_spacing(points[i])
                                : particle_spacing(setup.dx, scene.snow[i].particles_per_cell));
  }
  check_count(scene, points, shapes, spacing, setup.dx);
  for (std::size_t i = 0; i < scene.snow.size(); ++i) {
    setup.snow.push_back(is_points(scene.snow[i]) ? std::move(points[i])
                                                  : place_particles(scene, i, shapes[i], spacing[i]));
    loosen(scene, i, setup.snow.back());
  }
  settle_overlaps(scene, setup, shapes, spacing);
  for (std::size_t i = 0; i < scene.snow.size(); ++i) check_domain(scene, i, setup.snow[i], setup.domain);
  check_reach(scene, setup);
  return setup;
}

}  // namespace firn
