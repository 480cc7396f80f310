// SPDX-License-Identifier: MIT
// The one list of materials. What kernels read (MaterialParams), what scenes state (src/mpm/material.h),
// names, kinds and every dispatch follow from it. docs/kernels.md says how to add one.
//
// The file of a material has three parts. `struct Name` is plain and seen by all: its name in scenes, what a
// person states of it alone (Stated), what its kernels read of it alone (Params) and how the second follows
// from the first (fill). `Lanes<Name>` are its kernels, compiled once per instruction set. `Twin<Name>` says
// the same once more in scalar double, from the definitions, for the tests.
#pragma once
#include <type_traits>

#include "kernels/materials/cam_clay.h"
#include "kernels/materials/drucker_prager.h"
#include "kernels/materials/neo_hookean.h"
#include "kernels/materials/params.h"
#include "kernels/materials/snow.h"

namespace firn::kernels {

template <template <class...> class Of>
using OfAllMaterials = Of<NeoHookean, Snow, DruckerPrager, CamClay>;

template <class... Materials>
struct ParamsOf : SharedParams, Materials::Params... {};
using MaterialParams = OfAllMaterials<ParamsOf>;

template <class... Materials>
struct MaterialList {
  static constexpr const char* kNames[] = {Materials::kName...};  // by kind

  template <class Material>
  static consteval MaterialKind kind() {
    static_assert((std::is_same_v<Material, Materials> || ...), "not in the list");
    std::int32_t place = 0;
    (void)((std::is_same_v<Material, Materials> || (++place, false)) || ...);
    return MaterialKind{place};
  }

  // Calls f(Material()) with the material of this kind.
  template <class F>
  __attribute__((always_inline)) static inline void visit(MaterialKind of, F&& f) {
    (void)((of == kind<Materials>() && (f(Materials()), true)) || ...);
  }
};
using AllMaterials = OfAllMaterials<MaterialList>;

template <class Material>
inline constexpr MaterialKind kKindOf = AllMaterials::kind<Material>();

}  // namespace firn::kernels
