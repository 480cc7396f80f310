// SPDX-License-Identifier: MIT
// The list of materials and how a batch that may mix them is evaluated: once for every object in it, under a
// mask. Snow is sorted by place, so nearly every batch holds one object. A new material is a header like
// material_snow.h and one line in `with_material`.
#pragma once
#include "kernels/mpm/batch.h"
#include "kernels/mpm/material_cam_clay.h"
#include "kernels/mpm/material_drucker_prager.h"
#include "kernels/mpm/material_neo_hookean.h"
#include "kernels/mpm/material_snow.h"

namespace firn::kernels::FIRN_ISA {

// Calls f(model) with the model of a kind; the model's functions are static.
template <class F>
FIRN_INLINE void with_material(MaterialKind kind, F&& f) {
  switch (kind) {
    case kNeoHookean:
      return f(NeoHookean{});
    case kSnow:
      return f(Snow{});
    case kDruckerPrager:
      return f(DruckerPrager{});
    case kCamClay:
      return f(CamClay{});
  }
}

// Calls f(model, params, mask) for every object among the lanes; the masks are disjoint and cover them all.
// `object[l]` is the same as lane l of the register.
template <class F>
FIRN_INLINE void for_each_object(const MaterialParams* materials, const std::int32_t* object, Ints objects,
                                 F&& f) {
  const auto call = [&](std::int32_t index, Mask mask) FIRN_INLINE_LAMBDA {
    const MaterialParams& params = materials[index];
    with_material(params.kind, [&](auto model) FIRN_INLINE_LAMBDA { f(model, params, mask); });
  };
  const Mask first = equal(objects, splat_int(object[0]));
  if (all(first)) [[likely]]
    return call(object[0], all_lanes());
  for (int left = kAllLanes; left != 0;) {
    const std::int32_t index = object[__builtin_ctz(static_cast<unsigned>(left))];
    const Mask mask = equal(objects, splat_int(index));
    call(index, mask);
    left &= ~lane_bits(mask);
  }
}

// The same for a batch; inert lanes count as its first particle's object.
template <class F>
FIRN_INLINE void for_each_object(const MaterialParams* materials, const std::uint32_t* objects, Batch b,
                                 F&& f) {
  const std::int32_t* column = reinterpret_cast<const std::int32_t*>(objects) + b.first;
  for_each_object(materials, column, load_first(column, b.count, column[0]), f);
}

}  // namespace firn::kernels::FIRN_ISA
