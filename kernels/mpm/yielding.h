// SPDX-License-Identifier: MIT
// Particles of a block whose F lies outside their yield surface, collected until they fill a register. A
// particle's result does not depend on its company, so neither grouping nor order changes a bit.
#pragma once
#include "kernels/mpm/materials.h"
#include "kernels/mpm/summary.h"

namespace firn::kernels::FIRN_ISA {

struct YieldingList {
  int count = 0;
  std::size_t particle[2 * kLanes + 16];

  FIRN_INLINE void add(Batch b, Mask yields) {
    unsigned left = static_cast<unsigned>(lane_bits(yields)) & ((1u << b.count) - 1);
    for (; left != 0; left &= left - 1) particle[count++] = b.first + __builtin_ctz(left);
  }

  // Projects the last `many` particles of the list, at most kLanes, and takes them off it.
  void project_last(const MaterialParams* materials, const ParticleView& p, int many, Summary& summary) {
    count -= many;
    const std::size_t* who = particle + count;
    alignas(64) float columns[10][kLanes];
    alignas(64) std::int32_t object[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const std::size_t i = who[l < many ? l : 0];
      for (int k = 0; k < 9; ++k) columns[k][l] = p.F[k][i];
      columns[9][l] = p.Jp[i];
      object[l] = static_cast<std::int32_t>(p.object[i]);
    }
    Mat3 f;
    for (int k = 0; k < 9; ++k) f.m[k] = load(columns[k]);
    Floats jp = load(columns[9]), wave2 = splat(0.f);
    for_each_object(materials, load(object),
                    [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                      summary.add_clamped(model.project(params, f, jp, mask), many);
                      wave2 = select(mask, model.wave_speed2(params, f, jp), wave2);
                    });
    summary.add_wave_speed(wave2);
    for (int k = 0; k < 9; ++k) store(columns[k], f.m[k]);
    store(columns[9], jp);
    for (int l = 0; l < many; ++l) {
      for (int k = 0; k < 9; ++k) p.F[k][who[l]] = columns[k][l];
      p.Jp[who[l]] = columns[9][l];
    }
  }
};

}  // namespace firn::kernels::FIRN_ISA
