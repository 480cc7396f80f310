// SPDX-License-Identifier: MIT
// What the kernels read of every material. What one material alone has is in its own file.
#pragma once
#include <cstdint>

namespace firn::kernels {

enum class MaterialKind : std::int32_t {};  // a place in the list of materials (list.h)

struct SharedParams {
  MaterialKind kind;
  std::int32_t plastic;        // 0: elastic, never projected
  float mu, lambda;            // Pa
  float inverse_density;       // m^3/kg, as placed
  float sigma_min, sigma_max;  // bounds of the singular values of F, where these are clamped
  float hardening;             // xi
  float jp_min, jp_max;
};

struct LameModuli {
  double mu, lambda;  // Pa
};

}  // namespace firn::kernels
