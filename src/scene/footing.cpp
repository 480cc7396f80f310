// SPDX-License-Identifier: MIT
#include "src/scene/footing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <unordered_map>

#include "src/core/parallel.h"
#include "src/core/rng.h"

namespace firn {
namespace {

// Bodies that touch one another are of one group.
class Groups {
 public:
  explicit Groups(std::size_t bodies) : parent_(bodies) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::size_t of(std::size_t body) {
    while (parent_[body] != body) body = parent_[body] = parent_[parent_[body]];
    return body;
  }
  void join(std::size_t a, std::size_t b) { parent_[of(a)] = of(b); }

 private:
  std::vector<std::size_t> parent_;
};

struct Cell {
  std::int64_t x, y, z;
  bool operator==(const Cell&) const = default;
};
struct HashOfCell {
  std::size_t operator()(const Cell& c) const { return hash_keys(c.x, c.y, c.z); }
};

// Those with particles in the same cell of side `reach` (m), or in two that are neighbours.
Groups touching(const std::vector<PlacedSnow>& snow, double reach) {
  Groups groups(snow.size());
  std::unordered_map<Cell, std::size_t, HashOfCell> first;  // body in a cell
  for (std::size_t body = 0; body < snow.size(); ++body) {
    for (const Vec3& p : snow[body].position) {
      const auto in = [&](int axis) { return static_cast<std::int64_t>(std::floor(p[axis] / reach)); };
      const auto [place, is_new] = first.try_emplace(Cell{in(0), in(1), in(2)}, body);
      if (!is_new && place->second != body) groups.join(place->second, body);
    }
  }
  for (const auto& [cell, body] : first) {
    for (int k = 14; k < 27; ++k) {  // the other half of the neighbours looks back
      const auto other = first.find({cell.x + k / 9 - 1, cell.y + k / 3 % 3 - 1, cell.z + k % 3 - 1});
      if (other != first.end() && other->second != body) groups.join(other->second, body);
    }
  }
  return groups;
}

double least_distance(const PlacedSnow& snow, const std::vector<Shape>& shapes) {
  constexpr std::size_t kChunk = 4096;
  std::vector<double> least((snow.position.size() + kChunk - 1) / kChunk, HUGE_VAL);
  parallel_chunks(snow.position.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (const Shape& shape : shapes)
        least[chunk] = std::min(least[chunk], signed_distance(shape, snow.position[i]));
    }
  });
  return least.empty() ? HUGE_VAL : *std::min_element(least.begin(), least.end());
}

double part_inside(const PlacedSnow& snow, const Shape& shape, double depth) {
  std::vector<unsigned char> inside(snow.position.size());
  parallel_for(inside.size(), 1024,
               [&](std::size_t i) { inside[i] = signed_distance(shape, snow.position[i]) < -depth; });
  const auto count = std::accumulate(inside.begin(), inside.end(), std::size_t{0});
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(inside.size(), 1));
}

}  // namespace

std::vector<Footing> footing_of(const SolverSetup& setup, const std::vector<Shape>& solids) {
  std::vector<Shape> colliders;
  for (const Collider& c : setup.colliders)
    colliders.push_back({c.shape.form, c.motion.pose(c.shape.pose, 0)});
  Groups groups = touching(setup.snow, setup.dx);
  std::vector<double> clearance(setup.snow.size(), HUGE_VAL);  // of a group
  std::vector<Footing> footings(setup.snow.size());
  for (std::size_t body = 0; body < setup.snow.size(); ++body) {
    double& least = clearance[groups.of(body)];
    if (least > setup.dx) least = std::min(least, least_distance(setup.snow[body], colliders));
    for (std::size_t solid = 0; solid < solids.size(); ++solid) {
      const double part = part_inside(setup.snow[body], solids[solid], setup.dx);
      if (part > footings[body].buried) footings[body].buried = part, footings[body].solid = solid;
    }
  }
  for (std::size_t body = 0; body < setup.snow.size(); ++body)
    footings[body].clearance = clearance[groups.of(body)];
  return footings;
}

}  // namespace firn
