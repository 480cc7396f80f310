// SPDX-License-Identifier: MIT
#include "src/render/snow_surface.h"

#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/render/directions.h"

namespace firn {
namespace {

using kernels::kBrickCells;
using kernels::kCellsPerBrick;

constexpr float kSupportCells = 1.9f;  // reach R of the density kernel (1 - q^2)^3, q = r/R
constexpr float kGrain = 0.10f;        // share of the ball's own normal
constexpr int kReach = 2;              // whole cells

}  // namespace

// Adds every ball near the brick to the nodes within its reach.
void SnowSurface::fill_brick(std::size_t brick, std::size_t slot) {
  const kernels::TraceGrid& grid = grid_->view();
  const int corner[3] = {static_cast<int>(brick / grid.bricks[2] / grid.bricks[1]) * kBrickCells,
                         static_cast<int>(brick / grid.bricks[2] % grid.bricks[1]) * kBrickCells,
                         static_cast<int>(brick % grid.bricks[2]) * kBrickCells};
  Node* nodes = &nodes_[slot * kCellsPerBrick];
  const auto add = [&](std::uint64_t ball) {
    // In cells, relative to the brick's first node.
    const float p[3] = {grid.x[ball] * grid.inv_cell - 0.5f - static_cast<float>(corner[0]),
                        grid.y[ball] * grid.inv_cell - 0.5f - static_cast<float>(corner[1]),
                        grid.z[ball] * grid.inv_cell - 0.5f - static_cast<float>(corner[2])};
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = std::max(static_cast<int>(std::ceil(p[a] - kSupportCells)), 0);
      high[a] = std::min(static_cast<int>(std::floor(p[a] + kSupportCells)), kBrickCells - 1);
    }
    for (int x = low[0]; x <= high[0]; ++x) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int z = low[2]; z <= high[2]; ++z) {
          const float d[3] = {static_cast<float>(x) - p[0], static_cast<float>(y) - p[1],
                              static_cast<float>(z) - p[2]};
          const float rest =
              1 - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * (1 / (kSupportCells * kSupportCells));
          if (rest <= 0) continue;
          Node& node = nodes[(x << 4) + (y << 2) + z];
          for (int a = 0; a < 3; ++a) node.gradient[a] += rest * rest * d[a];
          node.density += rest * rest * rest;
        }
      }
    }
  };
  for (int x = corner[0] - kReach; x < corner[0] + kBrickCells + kReach; ++x) {
    for (int y = corner[1] - kReach; y < corner[1] + kBrickCells + kReach; ++y) {
      for (int z = corner[2] - kReach; z < corner[2] + kBrickCells + kReach; ++z) {
        const std::size_t cell = cell_index(grid, x, y, z);
        if (cell == kNoCell) continue;
        for (std::uint64_t s = grid.cell_start[cell]; s < grid.cell_start[cell + 1]; ++s) add(s);
      }
    }
  }
}

// With n particles a cell: gradient of a flat face n pi R^4 / 24, density inside n 64 pi R^3 / 315 (integrals
// of the kernel's slope (1 - q^2)^2 d over a half ball and of the kernel over a ball).
void SnowSurface::build(const RenderGrid& grid) {
  grid_ = &grid;
  const auto& bricks = grid.brick_of_slot();
  nodes_.assign(bricks.size() * kCellsPerBrick, Node{});
  const double per_cell = std::pow(grid.view().cell / grid.spacing(), 3), r = kSupportCells;
  const auto face = static_cast<float>(24 / (per_cell * kPi * r * r * r * r));
  const auto inside = static_cast<float>(315 / (per_cell * 64 * kPi * r * r * r));
  parallel_for(bricks.size(), 4, [&](std::size_t slot) {
    if (grid.is_core(slot)) return;  // no ray comes here: the ball's own normal will do
    fill_brick(bricks[slot], slot);
    for (int c = 0; c < kCellsPerBrick; ++c) {
      Node& node = nodes_[slot * kCellsPerBrick + c];
      for (float& component : node.gradient) component *= face;
      node.density *= inside;
    }
  });
}

Vec3f SnowSurface::normal(const Vec3f& p, const Vec3f& ball_normal) const {
  const kernels::TraceGrid& grid = grid_->view();
  int base[3];
  float f[3];
  for (int a = 0; a < 3; ++a) {
    const float at = std::clamp(p[a] * grid.inv_cell - 0.5f, -1.f, 4e6f);
    const float floor = std::floor(at);
    base[a] = static_cast<int>(floor);
    f[a] = at - floor;
  }
  Vec3f gradient = Vec3f::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
    const std::size_t node = cell_index(grid, base[0] + x, base[1] + y, base[2] + z);
    if (node == kNoCell) continue;
    const float weight = (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2]);
    for (int a = 0; a < 3; ++a) gradient[a] += weight * nodes_[node].gradient[a];
  }
  const Vec3f sum = gradient + kGrain * ball_normal;
  const float length = sum.norm();
  return length > 1e-6f ? Vec3f(sum / length) : ball_normal;
}

}  // namespace firn
