// SPDX-License-Identifier: MIT
#include "src/render/cell_lists.h"

#include <algorithm>
#include <cmath>

#include "src/render/render_grid.h"

namespace firn {
namespace {

using kernels::kBrickCells;

// Squared distance along one axis from a coordinate to the cell [low, low + size].
float gap2(float p, float low, float size) {
  const float gap = std::max({low - p, p - (low + size), 0.f});
  return gap * gap;
}

// Enters one ball into the cells of the brick that it overlaps.
void enter(const kernels::TraceGrid& grid, const int corner[3], std::uint32_t ball, float margin,
           CellLists& lists) {
  const float p[3] = {grid.x[ball], grid.y[ball], grid.z[ball]};
  const float reach = grid.radius[ball] + margin;
  int low[3], high[3];
  float gaps[3][kBrickCells];
  for (int a = 0; a < 3; ++a) {
    low[a] = std::max(static_cast<int>(std::floor((p[a] - reach) * grid.inv_cell)) - corner[a], 0);
    high[a] =
        std::min(static_cast<int>(std::floor((p[a] + reach) * grid.inv_cell)) - corner[a], kBrickCells - 1);
    if (low[a] > high[a]) return;
    for (int i = low[a]; i <= high[a]; ++i) {
      gaps[a][i] = gap2(p[a], static_cast<float>(corner[a] + i) * grid.cell, grid.cell);
    }
  }
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        if (gaps[0][x] + gaps[1][y] + gaps[2][z] <= reach * reach)
          lists.ball[(x << 4) + (y << 2) + z].push_back(ball);
      }
    }
  }
}

}  // namespace

void gather_cell_lists(const kernels::TraceGrid& grid, std::size_t brick, float margin, CellLists& lists) {
  const int corner[3] = {static_cast<int>(brick / grid.bricks[2] / grid.bricks[1]) * kBrickCells,
                         static_cast<int>(brick / grid.bricks[2] % grid.bricks[1]) * kBrickCells,
                         static_cast<int>(brick % grid.bricks[2]) * kBrickCells};
  const int reach = static_cast<int>((grid.max_radius + margin) * grid.inv_cell) + 1;
  int low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    low[a] = std::max(corner[a] - reach, 0);
    high[a] = std::min(corner[a] + kBrickCells - 1 + reach, grid.cells[a] - 1);
  }
  for (int x = low[0]; x <= high[0]; ++x) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int z = low[2]; z <= high[2]; ++z) {
        const std::size_t cell = cell_index(grid, x, y, z);
        if (cell == kNoCell) continue;
        for (std::uint64_t s = grid.cell_start[cell]; s < grid.cell_start[cell + 1]; ++s) {
          enter(grid, corner, static_cast<std::uint32_t>(s), margin, lists);
        }
      }
    }
  }
}

kernels::BallBundle make_bundle(const kernels::TraceGrid& grid, const std::uint32_t* ball,
                                std::size_t count) {
  kernels::BallBundle bundle{};
  for (std::size_t i = 0; i < kernels::kRayLanes; ++i) {
    const bool used = i < count;
    bundle.particle[i] = used ? ball[i] : kernels::kNoHit;
    bundle.r2[i] = used ? grid.radius[ball[i]] * grid.radius[ball[i]] : -1.f;
    if (!used) continue;
    bundle.x[i] = grid.x[ball[i]];
    bundle.y[i] = grid.y[ball[i]];
    bundle.z[i] = grid.z[ball[i]];
  }
  return bundle;
}

}  // namespace firn
