// SPDX-License-Identifier: MIT
// The one list of what a particle is. Allocation, sorting, hashing, checkpoints and the docs iterate it; the
// columns of kernels::ParticleView stand in the same order. Every column holds four bytes a particle.
#pragma once
#include <cstddef>

namespace firn {

struct Field {
  const char* name;
  int width;  // columns
  const char* unit;
  const char* meaning;
};

inline constexpr Field kFields[] = {
    {"x", 3, "2^-28 cells", "position from the corner of the particle's block, fixed point"},
    {"v", 3, "m/s", "velocity"},
    {"C", 9, "1/s", "APIC velocity gradient, row-major"},
    {"F", 9, "-", "elastic deformation gradient, row-major"},
    {"Jp", 1, "-", "plastic volume ratio; negative: a layer that collapses has lost its cohesion"},
    {"m", 1, "kg", "mass"},
    {"id", 1, "-", "number, constant over the run"},
    {"object", 1, "-", "index of the snow object it came from"},
};

constexpr std::size_t count_columns() {
  std::size_t columns = 0;
  for (const Field& field : kFields) columns += static_cast<std::size_t>(field.width);
  return columns;
}
inline constexpr std::size_t kColumns = count_columns();

}  // namespace firn
