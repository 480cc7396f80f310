// SPDX-License-Identifier: MIT
// Tile -> particles: v = sum w v_i, C = 4/dx^2 sum w v_i (x_i - x_p)^T, then x += dt v, F = (I + dt C) F with
// this very C, and plasticity. Gathered with nodes in lanes into one record a particle, transposed, then one
// particle a lane. Particles that yield are few and scattered: they are collected and projected together, so
// that the decomposition always works on full registers.
#include "kernels/mpm/gather.h"
#include "kernels/mpm/materials.h"
#include "kernels/mpm/summary.h"
#include "kernels/mpm/yielding.h"

namespace firn::kernels::FIRN_ISA {

namespace {

FIRN_INLINE Ints move(const ParticleView& p, int axis, Batch b, Floats displacement) {
  const Ints x = wrapping_add(load_first(p.x[axis] + b.first, b.count, 0), round_to_int(displacement));
  store_first(p.x[axis] + b.first, b.count, x);
  return x;
}

FIRN_INLINE void update_particles(const StepParams& step, const MaterialParams* materials,
                                  const ParticleView& p, Batch b, int slot, const Gathered& gathered,
                                  YieldingList& yielding, Summary& summary) {
  Vec3 v;
  Mat3 c;
  load_gathered(gathered, slot, kGatheredC * step.inv_dx, v, c);
  store_vec3(p.v, b, v);
  store_mat3(p.C, b, c);
  const Floats to_fixed = splat(step.dt * step.inv_dx * static_cast<float>(kOneCell));
  summary.add_position(move(p, 0, b, v.x * to_fixed), move(p, 1, b, v.y * to_fixed),
                       move(p, 2, b, v.z * to_fixed));

  const Deformation d = deformation_of(advance(c, splat(step.dt), load_mat3(p.F, b, 1.f)));
  const Floats jp = load(p.Jp, b, 1.f), zero = splat(0.f);
  store_mat3(p.F, b, d.f);
  Floats wave2 = zero;
  for_each_object(materials, p.object, b,
                  [&](auto model, const MaterialParams& params, Mask lanes) FIRN_INLINE_LAMBDA {
                    const Mask mask = lanes & mask_of_first(b.count);  // inert lanes are no snow
                    wave2 = select(mask, model.wave_speed2(params, d, jp), wave2);
                    if (!params.plastic) return;
                    const Mask yields = mask & model.yields(params, d, jp);
                    wave2 = select(yields, zero, wave2);  // known when they are projected
                    if (any(yields)) yielding.add(p, b, d.f, jp, yields);
                  });
  summary.add_motion(v, c, d, jp, wave2);
}

}  // namespace

void g2p(const StepParams& step, const MaterialParams* materials, const ParticleView& p, ParticleRange range,
         const float* tile, BlockSummary* out) {
  GatherWeights weights;
  Gathered gathered;
  YieldingList yielding(range.begin);
  Summary summary;
  for (std::size_t first = range.begin; first < range.end; first += kBatch) {
    int count = 0;
    for (int slot = 0; slot < kBatch && first + slot < range.end; slot += kLanes) {
      count += with_batch(range, first + slot, [&](Batch b) FIRN_INLINE_LAMBDA {
        fill_gather_weights(place_of(p, b), slot, weights);
      });
    }
    prefetch(p, first + kAhead);
    gather(weights, count, tile, gathered);
    clear_from(count, gathered);
    for (int slot = 0; slot < count; slot += kLanes) {
      with_batch(range, first + slot, [&](Batch b) FIRN_INLINE_LAMBDA {
        update_particles(step, materials, p, b, slot, gathered, yielding, summary);
        if (yielding.fills_register()) yielding.project_last(step, materials, p, summary);
      });
    }
  }
  yielding.project_rest(step, materials, p, summary);
  summary.write(*out);
}

}  // namespace firn::kernels::FIRN_ISA
