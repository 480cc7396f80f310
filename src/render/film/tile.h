// SPDX-License-Identifier: MIT
// Which pixels, and which of them.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace firn {

struct Tile {
  int x0, y0, x1, y1;  // pixels, half open
};

// Pixels of a film.
class PixelSet {
 public:
  PixelSet() = default;
  PixelSet(int width, int height) : width_(width), in_(static_cast<std::size_t>(width) * height, 1) {}  // all

  bool has(int x, int y) const { return in_[static_cast<std::size_t>(y) * width_ + x] != 0; }
  void drop(int x, int y) { in_[static_cast<std::size_t>(y) * width_ + x] = 0; }
  void drop(const Tile& tile) {
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) drop(x, y);
    }
  }
  // Of squares of `side` pixels: the first of each `one_of`, row by row.
  void keep_one_tile_of(int one_of, int side) {
    const int height = width_ > 0 ? static_cast<int>(in_.size()) / width_ : 0;
    int tiles = 0;
    for (int y = 0; y < height; y += side) {
      for (int x = 0; x < width_; x += side) {
        if (tiles++ % one_of != 0) drop({x, y, std::min(x + side, width_), std::min(y + side, height)});
      }
    }
  }
  bool any(const Tile& tile) const {
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        if (has(x, y)) return true;
      }
    }
    return false;
  }

 private:
  int width_ = 0;
  std::vector<std::uint8_t> in_;
};

}  // namespace firn
