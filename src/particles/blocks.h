// SPDX-License-Identifier: MIT
// Blocks of 4x4x4 cells: where they are, and which particles lie in them. Blocks are ordered by their Morton
// key, so blocks near in space are near in memory.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace firn {

using BlockKey = std::uint64_t;

struct BlockCoord {
  std::int32_t x, y, z;  // block (0,0,0) holds the cells 0..3 on each axis
  bool operator==(const BlockCoord&) const = default;
};

inline constexpr int kBlockBits = 19;  // an axis: +-2^18 blocks, +-2^20 cells
inline constexpr std::int32_t kBlockReach = 1 << (kBlockBits - 1);

constexpr bool addressable(const BlockCoord& b) {
  const auto inside = [](std::int32_t c) {
    return c > -kBlockReach && c < kBlockReach - 1;
  };  // neighbours too
  return inside(b.x) && inside(b.y) && inside(b.z);
}

// Spreads the low 21 bits of v to every third bit.
constexpr std::uint64_t spread_bits(std::uint64_t v) {
  v = (v | (v << 32)) & 0x001f00000000ffffull;
  v = (v | (v << 16)) & 0x001f0000ff0000ffull;
  v = (v | (v << 8)) & 0x100f00f00f00f00full;
  v = (v | (v << 4)) & 0x10c30c30c30c30c3ull;
  return (v | (v << 2)) & 0x1249249249249249ull;
}

constexpr BlockKey block_key(const BlockCoord& b) {
  const auto bits = [](std::int64_t c) { return spread_bits(static_cast<std::uint64_t>(c + kBlockReach)); };
  return (bits(b.x) << 2) | (bits(b.y) << 1) | bits(b.z);
}

// The block at neighbour n of b: n = (dx + 1) * 9 + (dy + 1) * 3 + (dz + 1), as kernels::kNeighbours counts.
constexpr BlockCoord neighbour(const BlockCoord& b, int n) {
  return {b.x + n / 9 - 1, b.y + n / 3 % 3 - 1, b.z + n % 3 - 1};
}

// The keys of all neighbours of b, and its own, in that order.
constexpr std::array<BlockKey, 27> keys_around(const BlockCoord& b) {
  BlockKey bits[3][3] = {};
  const std::int64_t corner[3] = {b.x - 1, b.y - 1, b.z - 1};
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < 3; ++i)
      bits[axis][i] = spread_bits(static_cast<std::uint64_t>(corner[axis] + i + kBlockReach)) << (2 - axis);
  }
  std::array<BlockKey, 27> keys{};
  for (int n = 0; n < 27; ++n) keys[n] = bits[0][n / 9] | bits[1][n / 3 % 3] | bits[2][n % 3];
  return keys;
}
static_assert(keys_around({5, -7, 11})[14] == block_key(neighbour({5, -7, 11}, 14)));

// The occupied blocks and their particles: block k holds particles [begin[k], begin[k + 1]).
struct ParticleBlocks {
  std::vector<BlockCoord> coord;
  std::vector<BlockKey> key;       // ascending
  std::vector<std::size_t> begin;  // one more than there are blocks
  std::vector<float> calm;         // s since anything in the block moved

  std::size_t size() const { return coord.size(); }
  std::size_t resident_bytes() const {
    return coord.capacity() * sizeof(BlockCoord) + key.capacity() * sizeof(BlockKey) +
           begin.capacity() * sizeof(std::size_t) + calm.capacity() * sizeof(float);
  }
};

// Index of `key` in an ascending list.
std::optional<std::size_t> find_block(const std::vector<BlockKey>& keys, BlockKey key);

}  // namespace firn
