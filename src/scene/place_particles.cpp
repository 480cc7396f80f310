// SPDX-License-Identifier: MIT
#include "src/scene/place_particles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include "firn/error.h"
#include "src/core/memory.h"
#include "src/core/rng.h"
#include "src/scene/clumps.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

// Streams of their own among the random numbers.
constexpr std::uint64_t kJitterKey = 0x717, kClumpKey = 0xc1;

// What a particle of compact snow takes at the least: its columns, its share of the grid, three snapshots.
constexpr double kBytesPerParticle = 270;

template <class T>
void erase_marked(std::vector<T>& column, const std::vector<unsigned char>& marked) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!marked[i]) column[kept++] = column[i];
  }
  column.resize(kept);
}

}  // namespace

PlacedSnow place_particles(const SceneConfig& scene, std::size_t index, const std::vector<Shape>& shapes,
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

void loosen(const SceneConfig& scene, std::size_t index, PlacedSnow& snow) {
  const SnowConfig& config = scene.snow[index];
  if (!(config.looseness > 0)) return;
  std::vector<float> packing = clump_packing(snow.position, config.looseness, config.clump_size,
                                             hash_keys(scene.simulation.seed, kClumpKey, index));
  for (std::size_t i = 0; i < snow.packing.size(); ++i) packing[i] *= snow.packing[i];
  snow.packing = std::move(packing);
}

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

void leave_out(PlacedSnow& snow, const std::vector<unsigned char>& marked) {
  if (!snow.packing.empty()) erase_marked(snow.packing, marked);
  if (!snow.strain.empty()) erase_marked(snow.strain, marked);
  if (!snow.volume.empty()) {
    erase_marked(snow.volume, marked);
    const double total = std::accumulate(snow.volume.begin(), snow.volume.end(), 0.0);
    snow.particle_volume = total / static_cast<double>(std::max<std::size_t>(snow.volume.size(), 1));
  }
  erase_marked(snow.velocity, marked);
  erase_marked(snow.position, marked);
}

void check_waves(const SceneConfig& scene, std::size_t index, double dx) {
  if (stable_dt(scene.snow[index].material, dx) > 0) return;
  throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index)),
              "elastic waves in snow '" + scene.snow[index].name +
                  "' have no finite speed, so no time step is short enough: its stiffness is out of "
                  "proportion to its density");
}

void check_domain(const SceneConfig& scene, std::size_t index, const PlacedSnow& snow,
                  const std::optional<Shape>& domain) {
  if (!domain || std::none_of(snow.position.begin(), snow.position.end(),
                              [&](const Vec3& p) { return signed_distance(*domain, p) > 0; }))
    return;
  throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index), "center"),
              "snow '" + snow.name + "' starts outside the domain box");
}

}  // namespace firn
