// SPDX-License-Identifier: MIT
// How a batch that may mix materials is evaluated: once for every object in it, under a mask. Snow is sorted
// by place, so nearly every batch holds one object.
#pragma once
#include "kernels/mpm/batch.h"

namespace firn::kernels::FIRN_ISA {

// Calls f(model, params, mask) for every object among the lanes; the masks are disjoint and cover them all.
// `object[l]` is the same as lane l of the register.
template <class F>
FIRN_INLINE void for_each_object(const MaterialParams* materials, const std::int32_t* object, Ints objects,
                                 F&& f) {
  const auto call = [&](std::int32_t index, Mask mask) FIRN_INLINE_LAMBDA {
    const MaterialParams& params = materials[index];
    AllMaterials::visit(
        params.kind, [&](auto material) FIRN_INLINE_LAMBDA { f(Lanes<decltype(material)>(), params, mask); });
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
