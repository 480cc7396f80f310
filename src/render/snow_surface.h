// SPDX-License-Identifier: MIT
// The smooth face of the snow: RenderGrid -> gradient of the particles' density at cell centres -> normals.
// Balls are what rays hit; if they also shaded as balls, a packed snowball would look like caviar. So the
// normal comes from the density over about 2.5 spacings, with a little of the ball's own normal left in as
// grain. Where the density says nothing (a lone particle, deep inside) the ball's normal takes over.
#pragma once
#include <vector>

#include "src/render/render_grid.h"

namespace firn {

class SnowSurface {
 public:
  // One node a cell of every occupied brick; summed in the order of the sorted balls.
  void build(const RenderGrid& grid);

  // Unit outward normal at a point `p` of a ball whose own normal there is `ball_normal`.
  Vec3f normal(const Vec3f& p, const Vec3f& ball_normal) const;

  std::size_t bytes() const { return nodes_.capacity() * sizeof(Node); }

 private:
  struct alignas(16) Node {
    float gradient[3] = {0, 0, 0};  // outward, 1 at a flat surface of evenly packed particles
    float density = 0;              // 1 inside evenly packed particles
  };

  void fill_brick(std::size_t brick, std::size_t slot);

  const RenderGrid* grid_ = nullptr;
  std::vector<Node> nodes_;
};

}  // namespace firn
