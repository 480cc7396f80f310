// SPDX-License-Identifier: MIT
#include "src/session/warnings.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "src/core/text.h"
#include "src/geometry/point_cloud.h"
#include "src/scene/footing.h"
#include "src/scene/place_points.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

constexpr double kBuried = 0.02;  // less of a body may dip into what it lies on
constexpr double kFewInCell = 2;  // points
constexpr double kOddVolume = 2;  // times what a point has room for

// What stands in the way of snow at the start, of all that is seen or felt.
struct Solids {
  std::vector<std::string> names;
  std::vector<Shape> shapes;
};

Solids solids_of(const SolverSetup& setup, const RenderSetup& render) {
  Solids solids;
  for (const Collider& c : setup.colliders) {
    solids.names.push_back(c.name == "ground" ? "the ground" : "collider '" + c.name + "'");
    solids.shapes.push_back({c.shape.form, c.motion.pose(c.shape.pose, 0)});
  }
  for (const Object& o : render.objects) {
    const SurfaceKind kind = render.surfaces[static_cast<std::size_t>(o.surface)].kind;
    if (kind == SurfaceKind::dielectric || kind == SurfaceKind::none) continue;  // snow may lie in glass
    if (std::find(solids.names.begin(), solids.names.end(), o.name) != solids.names.end()) continue;
    solids.names.push_back(o.name);
    solids.shapes.push_back({o.shape.form, o.motion.pose(o.shape.pose, 0)});
  }
  return solids;
}

bool is_at_rest(const SnowConfig& snow) {
  return snow.velocity.isZero(0) && snow.spin.isZero(0) && !snow.terminal_velocity;
}

// The warnings as they are found.
class Findings {
 public:
  explicit Findings(const SceneConfig& scene) : scene_(scene) {}

  void add(WarningKind kind, std::size_t snow, const std::string& what) {
    list_.push_back({kind, snow, place_of(scene_, table_of("snow", snow)), what});
  }
  std::string name(std::size_t snow) const { return "snow '" + scene_.snow[snow].name + "'"; }
  std::vector<SceneWarning> list() && { return std::move(list_); }

 private:
  const SceneConfig& scene_;
  std::vector<SceneWarning> list_;
};

void find_buried(Findings& found, std::size_t snow, const Footing& footing, const Solids& solids) {
  if (footing.buried > kBuried)
    found.add(WarningKind::buried, snow,
              text("%.3g %% of ", 100 * footing.buried) + found.name(snow) + " lies under the surface of " +
                  solids.names[footing.solid]);
}

void find_floating(Findings& found, std::size_t snow, const Footing& footing, double dx) {
  if (std::isinf(footing.clearance)) {
    found.add(WarningKind::floating, snow,
              found.name(snow) + " floats: there is no ground or collider to fall onto");
  } else if (footing.clearance > 2 * dx) {
    found.add(WarningKind::floating, snow,
              found.name(snow) + " floats: all that it could lie on is " + text("%.3g m", footing.clearance) +
                  " away or more, and it will fall");
  }
}

// The grid may be too fine for points, which lie as they lie.
void find_sparse(Findings& found, std::size_t snow, double volume, double dx) {
  const double in_cell = std::pow(dx, 3) / volume;
  if (in_cell < kFewInCell)
    found.add(WarningKind::sparse_points, snow,
              found.name(snow) + text(" has %.2g points a cell of the grid and will fall apart: ", in_cell) +
                  text("dx = %.3g m is coarse enough for them", 2 * std::cbrt(volume)));
}

// Their volumes may be in another unit.
void find_odd(Findings& found, std::size_t snow, double volume, double room) {
  const double ratio = volume / room;
  if (room > 0 && (ratio > kOddVolume || ratio < 1 / kOddVolume))
    found.add(WarningKind::odd_points, snow,
              "a point of " + found.name(snow) +
                  text(" stands for %.3g m3 and has room for %.3g m3: ", volume, room) +
                  "is the file's volume, mass or radius in another unit?");
}

}  // namespace

std::vector<SceneWarning> warnings_of_placement(const SceneConfig& scene, const SolverSetup& setup,
                                                const RenderSetup& render) {
  Findings found(scene);
  const Solids solids = solids_of(setup, render);
  const std::vector<Footing> footings = footing_of(setup, solids.shapes);
  for (std::size_t i = 0; i < footings.size(); ++i) {
    find_buried(found, i, footings[i], solids);
    if (!setup.gravity.isZero(0) && is_at_rest(scene.snow[i])) find_floating(found, i, footings[i], setup.dx);
  }
  for (std::size_t i = 0; i < setup.snow.size(); ++i) {
    if (!is_points(scene.snow[i])) continue;
    const PlacedSnow& points = setup.snow[i];
    find_sparse(found, i, points.particle_volume, setup.dx);
    find_odd(found, i, points.particle_volume, volume_of_point(PointTree(points.position)));
  }
  return std::move(found).list();
}

std::vector<SceneWarning> warnings_of_view(const SceneConfig& scene, const Sights& sights) {
  Findings found(scene);
  for (std::size_t i = 0; i < sights.snow.size(); ++i) {
    if (sights.snow[i] == 0)
      found.add(WarningKind::unseen, i, "the camera sees nothing of " + found.name(i) + " in frame 0");
  }
  return std::move(found).list();
}

}  // namespace firn
