// SPDX-License-Identifier: MIT
// Between the 8x8x8 tiles of particle blocks and the 4x4x4 blocks of the grid. Every grid block sums the
// tiles around it in one fixed order, so no thread writes where another does and the bits do not depend on
// how many there are.
//
//   tile index on an axis    0 | 1 2 3 4 | 5 6 7
//   lies in the block at    -1 |    0    |  +1
#include "kernels/mpm/table.h"
#include "kernels/simd/lanes.h"

namespace firn::kernels::FIRN_ISA {

namespace {

// Where the tile of the block at offset d overlaps this one: tile nodes [tile, tile + count) are block nodes
// [node, node + count).
struct Overlap {
  int tile, node, count;
};
constexpr Overlap kFromBlock[3] = {{5, 0, 3}, {1, 0, 4}, {0, 3, 1}};  // d = -1, 0, +1
// Seen from the tile's own block: the block at offset d holds these tile nodes.
constexpr Overlap kFromTile[3] = {{0, 3, 1}, {1, 0, 4}, {5, 0, 3}};

constexpr int tile_at(int x, int y, int z) { return ((x * kTileSide + y) * kTileSide + z) * kNodeFloats; }
constexpr int node_at(int x, int y, int z) { return ((x * kBlockSide + y) * kBlockSide + z) * kNodeFloats; }

// The compiler turns these into whole-register moves: counts are compile-time constants.
template <int count>
FIRN_INLINE void add_run(const float* from, float* to) {
  for (int i = 0; i < count * kNodeFloats; ++i) to[i] += from[i];
}
template <int count>
FIRN_INLINE void copy_run(const float* from, float* to) {
  for (int i = 0; i < count * kNodeFloats; ++i) to[i] = from[i];
}

template <int dz>
FIRN_INLINE void add_part(const float* tile, int dx, int dy, float* nodes) {
  const Overlap x = kFromBlock[dx], y = kFromBlock[dy];
  constexpr Overlap z = kFromBlock[dz];
  for (int i = 0; i < x.count; ++i) {
    for (int j = 0; j < y.count; ++j) {
      add_run<z.count>(tile + tile_at(x.tile + i, y.tile + j, z.tile),
                       nodes + node_at(x.node + i, y.node + j, z.node));
    }
  }
}

template <int dz>
FIRN_INLINE void copy_part(const float* nodes, int dx, int dy, float* tile) {
  const Overlap x = kFromTile[dx], y = kFromTile[dy];
  constexpr Overlap z = kFromTile[dz];
  for (int i = 0; i < x.count; ++i) {
    for (int j = 0; j < y.count; ++j) {
      copy_run<z.count>(nodes + node_at(x.node + i, y.node + j, z.node),
                        tile + tile_at(x.tile + i, y.tile + j, z.tile));
    }
  }
}

}  // namespace

void reduce_tiles(const float* const tiles[kNeighbours], float* nodes) {
  for (int i = 0; i < kBlockFloats; i += kLanes) store(nodes + i, splat(0.f));
  for (int n = 0; n < kNeighbours; n += 3) {
    const int dx = n / 9, dy = n / 3 % 3;
    if (tiles[n]) add_part<0>(tiles[n], dx, dy, nodes);
    if (tiles[n + 1]) add_part<1>(tiles[n + 1], dx, dy, nodes);
    if (tiles[n + 2]) add_part<2>(tiles[n + 2], dx, dy, nodes);
  }
}

void assemble_tile(const float* const blocks[kNeighbours], float* tile) {
  for (int n = 0; n < kNeighbours; n += 3) {
    const int dx = n / 9, dy = n / 3 % 3;
    copy_part<0>(blocks[n], dx, dy, tile);
    copy_part<1>(blocks[n + 1], dx, dy, tile);
    copy_part<2>(blocks[n + 2], dx, dy, tile);
  }
  for (int i = kTileFloats; i < kTileStride; ++i) tile[i] = 0.f;
}

}  // namespace firn::kernels::FIRN_ISA
