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
#include "src/core/memory.h"
#include "src/core/rng.h"
#include "src/particles/blocks.h"
#include "src/scene/clumps.h"
#include "src/scene/emit.h"
#include "src/scene/overlaps.h"
#include "src/scene/place_points.h"
#include "src/scene/place_shape.h"
#include "src/scene/scene.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// Streams of their own among the random numbers.
constexpr std::uint64_t kJitterKey = 0x717, kClumpKey = 0xc1;

// What a particle of compact snow takes at the least: its columns, its share of the grid, three snapshots.
constexpr double kBytesPerParticle = 270;

// m; the narrowest side of a snow object's bounds in its own frame.
double narrowest(const SceneConfig& scene, std::size_t index) {
  const ShapeConfig& config = scene.snow[index].shape;
  if (config.shape == "flakes") return 2 * *config.radius;
  const Shape shape = place_shape(scene, table_of("snow", index), config, ShapeUse::snow);
  return world_bounds({shape.form, Pose{}}).size().minCoeff();
}

PlacedSnow place(const SceneConfig& scene, std::size_t index, const std::vector<Shape>& shapes,
                 double spacing) {
  const SnowConfig& config = scene.snow[index];
  PlacedSnow snow{config.name, config.material, {}, {}, {}, 0, config.terminal_velocity, {}, {}};
  double total = 0;
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const Vec3 center = world_bounds(shapes[s]).center();
    for (const Vec3& p :
         fill_shape(shapes[s], spacing, hash_keys(scene.simulation.seed, kJitterKey, index, s))) {
      snow.position.push_back(p);
      snow.velocity.push_back(config.velocity + config.spin.cross(p - center));
    }
    total += *volume(shapes[s]);
  }
  if (snow.position.empty()) {
    throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index)),
                "empty snow: no particle fits into '" + config.name +
                    "'; its shape is smaller than the particle spacing");
  }
  // The shape's true volume is shared out, so that density times volume is the mass that was asked for.
  snow.particle_volume = total / static_cast<double>(snow.position.size());
  return snow;
}

// Loosens the seams between clumps, beside what the packing was.
void loosen(const SceneConfig& scene, std::size_t index, PlacedSnow& snow) {
  const SnowConfig& config = scene.snow[index];
  if (!(config.looseness > 0)) return;
  std::vector<float> packing = clump_packing(snow.position, config.looseness, config.clump_size,
                                             hash_keys(scene.simulation.seed, kClumpKey, index));
  for (std::size_t i = 0; i < snow.packing.size(); ++i) packing[i] *= snow.packing[i];
  snow.packing = std::move(packing);
}

void place_colliders(const SceneConfig& scene, SimulationSetup& setup) {
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

std::optional<Shape> domain_box(const SimulationConfig& config) {
  if (!config.domain_min) return std::nullopt;
  return Shape{Box{0.5 * (*config.domain_max - *config.domain_min)},
               {rotation_matrix(config.domain_rotation), 0.5 * (*config.domain_min + *config.domain_max)}};
}

void check_domain(const SceneConfig& scene, const SimulationSetup& setup) {
  if (!setup.domain) return;
  for (std::size_t i = 0; i < setup.snow.size(); ++i) {
    const auto& positions = setup.snow[i].position;
    if (std::any_of(positions.begin(), positions.end(),
                    [&](const Vec3& p) { return signed_distance(*setup.domain, p) > 0; })) {
      throw Error(ErrorCode::usage, place_of(scene, table_of("snow", i), "center"),
                  "snow '" + scene.snow[i].name + "' starts outside the domain box");
    }
  }
}

// Before the simulation says it of all snow alike: maps have coordinates that are far from 0.
void check_reach(const SceneConfig& scene, const SimulationSetup& setup) {
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

void check_waves(const SceneConfig& scene, double dx) {
  for (std::size_t i = 0; i < scene.snow.size(); ++i) {
    if (stable_dt(scene.snow[i].material, dx) > 0) continue;
    throw Error(ErrorCode::usage, place_of(scene, table_of("snow", i)),
                "elastic waves in snow '" + scene.snow[i].name +
                    "' have no finite speed, so no time step is short enough: its stiffness is out of "
                    "proportion to its density");
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

// Before any is placed: a scene that is far too fine would take all memory, and for ever.
void check_count(const SceneConfig& scene, const std::vector<PlacedSnow>& points,
                 const std::vector<std::vector<Shape>>& shapes, const std::vector<double>& spacing,
                 double dx) {
  double count = 0;
  for (const PlacedSnow& snow : points) count += static_cast<double>(snow.position.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    for (const Shape& shape : shapes[i]) count += *volume(shape) / std::pow(spacing[i], 3);
  }
  const double needed = count * kBytesPerParticle, there = static_cast<double>(machine_memory());
  if (needed <= there) return;
  char text[240];
  std::snprintf(text, sizeof text,
                "dx = %.3g m makes about %.3g particles, which need some %.3g GiB; this machine has %.3g "
                "GiB: take a larger dx, or fewer "
                "particles across",
                dx, count, needed / kBytesPerGibibyte, there / kBytesPerGibibyte);
  throw Error(ErrorCode::usage,
              place_of(scene, "simulation", scene.simulation.dx ? "dx" : "particles_across"), text);
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

double grid_spacing(const SceneConfig& scene) {
  if (scene.simulation.dx) return *scene.simulation.dx;
  return grid_spacing_for(scene, place_all_points(scene));
}

SimulationSetup build_simulation(const SceneConfig& scene, bool force) {
  SimulationSetup setup;
  std::vector<PlacedSnow> points = place_all_points(scene);
  setup.dx = grid_spacing_for(scene, points);
  setup.gravity = scene.simulation.gravity;
  setup.fixed_dt = scene.simulation.dt;
  setup.domain = domain_box(scene.simulation);
  if (setup.domain && !scene.simulation.domain_rotation.isZero(0)) setup.frame = setup.domain->pose;
  setup.sleep = scene.simulation.sleep;
  check_waves(scene, setup.dx);
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
                                                  : place(scene, i, shapes[i], spacing[i]));
    loosen(scene, i, setup.snow.back());
  }
  settle_overlaps(scene, setup, shapes, spacing);
  check_domain(scene, setup);
  check_reach(scene, setup);
  return setup;
}

}  // namespace firn
