// SPDX-License-Identifier: MIT
// What a flat layer of snow reflects and lets through, by diffusion. With y = 4 sqrt(co-albedo / 3 (1 - g))
// and tau = (1 - g) sigma_t thickness, the layer's transport optical thickness:
//   R = sinh(x) / sinh(x + y),   T = sinh(y) / sinh(x + y),   x = 3/4 tau y
// (Kokhanovsky and Zege 2004, Applied Optics 43, 1589). Without absorption T = 1 / (1 + 3/4 tau), R = 1 - T;
// without end R = exp(-y). It holds for layers of a few transport mean free paths and more, under light from
// all sides.
#pragma once
#include <cstddef>
#include <vector>

#include "src/render/setup.h"

namespace firn {

// y in red, green and blue light of 610, 545 and 460 nm.
Vec3 layer_exponent(const SnowLook& look, IceSource ice);

struct SnowLayer {
  Vec3f reflected = Vec3f::Zero(), passed = Vec3f::Zero();
};
SnowLayer snow_layer(const SnowLook& look, IceSource ice, double transport_depth);

// The same from a table for each object.
class SnowLayers {
 public:
  SnowLayers(std::vector<SnowLook> looks, IceSource ice);

  // Of so much snow, kg/m^2.
  SnowLayer of(std::size_t object, float column) const;
  // m: the transport mean free path at a density, kg/m^3.
  float transport_path(std::size_t object, float density) const;
  float transport_depth(std::size_t object, float column) const { return each(object).per_column * column; }

 private:
  struct Table {
    float per_column;  // m^2/kg: transport optical thickness of a column
    std::vector<SnowLayer> layers;
  };
  const Table& each(std::size_t object) const { return tables_[object < tables_.size() ? object : 0]; }

  std::vector<Table> tables_;
};

}  // namespace firn
