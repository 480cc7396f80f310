// SPDX-License-Identifier: MIT
// Bodies whose bounds meet are found by a sweep along the axis on which they are spread most; only their
// particles are asked one by one. Snow made of points has no surface: it counts as the union of balls about
// its points that just leave no gap on a cubic lattice.
#include "src/scene/overlaps.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "firn/error.h"
#include "src/core/parallel.h"
#include "src/geometry/point_tree.h"
#include "src/scene/place_particles.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

constexpr std::size_t kMostNamed = 8;       // overlaps in one message
constexpr std::size_t kMostCounted = 1000;  // thousands of bodies in one place have millions

struct Body {
  std::string name;
  std::vector<Shape> shapes;
  std::vector<Bounds> bounds;  // of each shape, m
  Bounds all;
  int snow;                                      // its index, or -1: a collider
  std::shared_ptr<const PointTree> points = {};  // of snow made of points that other snow is near to
  double reach = 0;                              // m, of the ball about each
};

Body make_body(std::string name, std::vector<Shape> shapes, int snow) {
  Body body{std::move(name), std::move(shapes), {}, {}, snow};
  for (const Shape& shape : body.shapes) {
    body.bounds.push_back(world_bounds(shape));
    body.all.include(body.bounds.back());
  }
  return body;
}

// `spacing` (m) of the points.
Body body_of_points(const PlacedSnow& snow, double spacing, int index) {
  Body body{"snow '" + snow.name + "'", {}, {}, {}, index};
  body.reach = 0.5 * std::sqrt(3.0) * spacing;
  for (const Vec3& p : snow.position) body.all.include(p);
  body.all.min.array() -= body.reach;
  body.all.max.array() += body.reach;
  return body;
}

bool holds(const Bounds& b, const Vec3& p) {
  return (p.array() >= b.min.array()).all() && (p.array() <= b.max.array()).all();
}
bool meet(const Bounds& a, const Bounds& b) {
  return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

std::vector<Body> bodies_of(const SolverSetup& setup, const std::vector<std::vector<Shape>>& shapes,
                            const std::vector<double>& spacing) {
  std::vector<Body> bodies;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const int index = static_cast<int>(i);
    bodies.push_back(shapes[i].empty() ? body_of_points(setup.snow[i], spacing[i], index)
                                       : make_body("snow '" + setup.snow[i].name + "'", shapes[i], index));
  }
  for (const Collider& c : setup.colliders) {
    const Shape at_start{c.shape.form, c.motion.pose(c.shape.pose, 0)};
    bodies.push_back(
        make_body(c.name == "ground" ? "the ground" : "collider '" + c.name + "'", {at_start}, -1));
  }
  return bodies;
}

// For each snow the other bodies whose bounds meet its own, in order.
std::vector<std::vector<int>> neighbours_of(const std::vector<Body>& bodies, std::size_t snows) {
  Bounds middles;
  for (const Body& body : bodies) {
    if (body.snow >= 0) middles.include(body.all.center());
  }
  Eigen::Index axis = 0;
  if (snows > 0) middles.size().maxCoeff(&axis);
  std::vector<int> order(bodies.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return bodies[a].all.min[axis] < bodies[b].all.min[axis]; });
  std::vector<std::vector<int>> neighbours(snows);
  std::vector<int> open;  // bodies that reach the sweep
  for (const int now : order) {
    std::erase_if(open, [&](int other) { return bodies[other].all.max[axis] < bodies[now].all.min[axis]; });
    for (const int other : open) {
      if (!meet(bodies[now].all, bodies[other].all)) continue;
      if (bodies[now].snow >= 0) neighbours[bodies[now].snow].push_back(other);
      if (bodies[other].snow >= 0) neighbours[bodies[other].snow].push_back(now);
    }
    open.push_back(now);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  return neighbours;
}

// Which particles of `snow` lie deeper than `depth` (m) inside a body.
std::vector<unsigned char> find_inside(const PlacedSnow& snow, const Body& body, double depth) {
  std::vector<unsigned char> inside(snow.position.size());
  parallel_for(inside.size(), 1024, [&](std::size_t i) {
    const Vec3& p = snow.position[i];
    if (!holds(body.all, p)) return;
    if (body.points) inside[i] = body.points->distance(p) - body.reach < -depth;
    for (std::size_t s = 0; s < body.shapes.size() && !inside[i]; ++s) {
      inside[i] = holds(body.bounds[s], p) && signed_distance(body.shapes[s], p) < -depth;
    }
  });
  return inside;
}

void trim(const SceneConfig& scene, PlacedSnow& snow, int index, const std::vector<Body>& bodies,
          const std::vector<int>& others) {
  std::vector<unsigned char> gone(snow.position.size());
  for (const int other : others) {
    const int its = bodies[other].snow;
    if (its >= 0 && scene.snow[its].trim && its > index) continue;
    const auto inside = find_inside(snow, bodies[other], 0);
    for (std::size_t i = 0; i < gone.size(); ++i) gone[i] |= inside[i];
  }
  leave_out(snow, gone);
  if (snow.position.empty())
    throw Error(ErrorCode::usage, place_of(scene, table_of("snow", index), "trim"),
                "all of snow '" + snow.name + "' lies inside other bodies: 'trim' leaves nothing of it");
}

// Of two snows that overlap the later one is told of, once.
bool is_allowed(const SceneConfig& scene, int index, int other) {
  if (scene.snow[index].allow_overlap) return true;
  return other >= 0 && (other > index || scene.snow[other].allow_overlap || scene.snow[other].trim);
}

}  // namespace

void settle_overlaps(const SceneConfig& scene, SolverSetup& setup,
                     const std::vector<std::vector<Shape>>& shapes, const std::vector<double>& spacing) {
  std::vector<Body> bodies = bodies_of(setup, shapes, spacing);
  const auto neighbours = neighbours_of(bodies, setup.snow.size());
  for (const auto& list : neighbours) {
    for (const int other : list) {
      const int index = bodies[other].snow;
      if (index >= 0 && shapes[index].empty() && !bodies[other].points)
        bodies[other].points = std::make_shared<PointTree>(setup.snow[index].position);
    }
  }
  for (std::size_t i = 0; i < setup.snow.size(); ++i) {
    if (scene.snow[i].trim) trim(scene, setup.snow[i], static_cast<int>(i), bodies, neighbours[i]);
  }
  std::vector<std::string> found;
  std::string where;
  for (int i = 0; i < static_cast<int>(setup.snow.size()) && found.size() <= kMostCounted; ++i) {
    if (scene.snow[i].trim) continue;
    for (const int other : neighbours[i]) {
      if (is_allowed(scene, i, bodies[other].snow)) continue;
      const auto inside = find_inside(setup.snow[i], bodies[other], 0.5 * spacing[i]);
      const auto count = std::count(inside.begin(), inside.end(), 1);
      if (count == 0) continue;
      if (found.empty()) where = place_of(scene, table_of("snow", i), "center");
      found.push_back("snow '" + setup.snow[i].name + "' starts inside " + bodies[other].name + " (" +
                      std::to_string(count) + " particles)");
    }
  }
  if (found.empty()) return;
  std::string text;
  for (std::size_t k = 0; k < std::min(found.size(), kMostNamed); ++k) text += (k ? ", " : "") + found[k];
  if (found.size() > kMostNamed)
    text += std::string(found.size() > kMostCounted ? ", and at least " : ", and ") +
            std::to_string(found.size() - kMostNamed) + " more";
  throw Error(ErrorCode::usage, where,
              text + "; move it, set trim = true to leave out what lies inside, or set allow_overlap = true");
}

}  // namespace firn
