// SPDX-License-Identifier: MIT
// What one frame of snow looks like: the only thing that mpm and render share. Written by the simulation into
// a slot, read by the renderer and the particle files, then the slot is used again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/core/vector.h"

namespace firn {

struct Snapshot {
  int frame = 0;
  double time = 0;             // s of simulated time
  Vec3 origin = Vec3::Zero();  // m, world; positions are relative to it so that float stays exact far from 0
  double dx = 0;               // m, the simulation's grid spacing

  // Columns, one entry a particle, in the simulation's block order (neighbours in space are near in memory).
  std::vector<float> x[3];     // m, relative to `origin`
  std::vector<float> v[3];     // m/s
  std::vector<float> density;  // kg/m^3, now (mass / (V0 * J * plastic volume ratio))
  std::vector<float> volume0;  // m^3, the volume that the particle was placed with
  // How far the particle has turned since it was placed, in world axes: PackedRotation. All 0: not at all.
  std::vector<std::int16_t> turn[3];
  std::vector<std::uint32_t> id;      // unique, constant over the run
  std::vector<std::uint16_t> object;  // index of the [[snow]] table that the particle came from

  std::size_t size() const { return id.size(); }
  Vec3 world_position(std::size_t i) const { return origin + Vec3(x[0][i], x[1][i], x[2][i]); }

  template <class F>
  void for_each_column(F&& f) {
    for (auto& c : x) f(c);
    for (auto& c : v) f(c);
    f(density);
    f(volume0);
    for (auto& c : turn) f(c);
    f(id);
    f(object);
  }
  void resize(std::size_t count) {
    for_each_column([count](auto& column) { column.resize(count); });
  }
};

}  // namespace firn
