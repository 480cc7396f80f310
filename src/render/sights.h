// SPDX-License-Identifier: MIT
// What the middles of pixels see straight, through the middle of the lens: a number of pixels for each. Glass
// and mirrors are seen themselves.
#pragma once
#include <cstddef>
#include <vector>

#include "src/render/film/tile.h"
#include "src/render/setup.h"

namespace firn {

struct View;

struct Sights {
  std::size_t pixels = 0, nothing = 0;  // all; those that look past everything, at sky or lamps
  std::vector<std::size_t> snow;        // by body: as Snapshot::object
  std::vector<std::size_t> objects;     // as RenderSetup::objects

  Sights& operator+=(const Sights& other);  // of the same setup
};

Sights no_sights(const RenderSetup& setup);
Sights sights_of(const View& view, const Tile& tile);

}  // namespace firn
