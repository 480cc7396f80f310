// SPDX-License-Identifier: MIT
// Between the 8x8x8 tiles of particle blocks and the 4x4x4 blocks of the grid. Every grid block sums the
// tiles around it in one fixed order, so no thread writes where another does and the bits do not depend on
// how many there are. A row of four z-nodes is one register on the widest machines.
//
//   tile index on an axis    0 | 1 2 3 4 | 5 6 7
//   lies in the block at    -1 |    0    |  +1
#include "kernels/mpm/stencil.h"
#include "kernels/mpm/table.h"

namespace firn::kernels::FIRN_ISA {

namespace {

constexpr int tile_at(int x, int y, int z) { return ((x * kTileSide + y) * kTileSide + z) * kNodeFloats; }
constexpr int node_at(int x, int y, int z) { return ((x * kBlockSide + y) * kBlockSide + z) * kNodeFloats; }

// Index `at` in the tile or block that lies `offset` - 1 away.
struct Source {
  int offset, at;
};
// On an axis a node of a block lies in the tiles of two blocks, and a node of a tile in one block.
constexpr Source kTilesOfNode[kBlockSide][2] = {
    {{0, 5}, {1, 1}}, {{0, 6}, {1, 2}}, {{0, 7}, {1, 3}}, {{1, 4}, {2, 0}}};
constexpr Source kBlockOfNode[kTileSide] = {{0, 3}, {1, 0}, {1, 1}, {1, 2}, {1, 3}, {2, 0}, {2, 1}, {2, 2}};

struct Row {
  Floats part[kParts];
};

// Adds what the three tiles along z at `tiles` hold of a row of block nodes; `at` is the row in them. Nodes
// 0 1 2 lie in the tile below as 5 6 7, node 3 in the tile above as 0, all of them in the tile between.
FIRN_INLINE void add_row(const float* const* tiles, int at, Row& sum) {
  const float *below = tiles[0] + at + 5 * kNodeFloats, *same = tiles[1] + at + kNodeFloats;
#pragma GCC unroll 4
  for (int k = 0; k < kParts; ++k) {
    Floats outer = load(below + k * kLanes);
    if (k == kParts - 1) outer = replace_last4(outer, load_repeated4(tiles[2] + at));
    sum.part[k] = (sum.part[k] + load(same + k * kLanes)) + outer;
  }
}

FIRN_INLINE Row sum_row(const float* const tiles[kNeighbours], int x, int y) {
  Row sum;
  for (Floats& part : sum.part) part = splat(0.f);
#pragma GCC unroll 2
  for (const Source& sx : kTilesOfNode[x]) {
#pragma GCC unroll 2
    for (const Source& sy : kTilesOfNode[y])
      add_row(tiles + (sx.offset * 3 + sy.offset) * 3, tile_at(sx.at, sy.at, 0), sum);
  }
  return sum;
}

}  // namespace

void reduce_tiles(const float* const tiles[kNeighbours], float* nodes) {
  alignas(64) static constexpr float kNoParticles[kTileStride] = {};
  const float* all[kNeighbours];
  for (int n = 0; n < kNeighbours; ++n) all[n] = tiles[n] ? tiles[n] : kNoParticles;
#pragma GCC unroll 4
  for (int x = 0; x < kBlockSide; ++x) {
#pragma GCC unroll 4
    for (int y = 0; y < kBlockSide; ++y) {
      const Row sum = sum_row(all, x, y);
      for (int k = 0; k < kParts; ++k) store(nodes + node_at(x, y, 0) + k * kLanes, sum.part[k]);
    }
  }
}

// Rows are written in order: what a row of whole registers spills into the next is overwritten by it.
void assemble_tile(const float* const blocks[kNeighbours], float* tile) {
  for (int x = 0; x < kTileSide; ++x) {
    for (int y = 0; y < kTileSide; ++y) {
      const Source sx = kBlockOfNode[x], sy = kBlockOfNode[y];
      const float* const* along_z = blocks + (sx.offset * 3 + sy.offset) * 3;
      const float *below = along_z[0] + node_at(sx.at, sy.at, 3),
                  *same = along_z[1] + node_at(sx.at, sy.at, 0),
                  *above = along_z[2] + node_at(sx.at, sy.at, 0);
      float* row = tile + tile_at(x, y, 0);
      for (int i = 0; i < kNodeFloats; ++i) row[i] = below[i];
      for (int k = 0; k < kRowFloats; k += kLanes) {
        store(row + kNodeFloats + k, load(same + k));
        store(row + 5 * kNodeFloats + k, load(above + k));
      }
    }
  }
  for (int i = kTileFloats; i < kTileStride; ++i) tile[i] = 0.f;
}

}  // namespace firn::kernels::FIRN_ISA
