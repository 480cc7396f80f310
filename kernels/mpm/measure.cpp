// SPDX-License-Identifier: MIT
// Looks at particles without moving them, and single stages of the step for tests and benches.
#include "kernels/mpm/materials.h"
#include "kernels/mpm/summary.h"
#include "kernels/mpm/table.h"

namespace firn::kernels::FIRN_ISA {

void summarise(const MaterialParams* materials, const ParticleView& p, ParticleRange range,
               BlockSummary* out) {
  Summary summary;
  for (std::size_t first = range.begin; first < range.end; first += kLanes) {
    const Batch b = batch_at(range, first);
    const Deformation d = deformation_of(load_mat3(p.F, b, 1.f));
    const Floats jp = load(p.Jp, b, 1.f);
    Floats wave2 = splat(0.f);
    for_each_object(materials, p.object, b,
                    [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                      wave2 = select(mask & mask_of_first(b.count), model.wave_speed2(params, d, jp), wave2);
                    });
    summary.add_motion(load_vec3(p.v, b), load_mat3(p.C, b, 0.f), d, jp, wave2);
  }
  summary.write(*out);
}

void elastic_energy(const MaterialParams* materials, const ParticleView& p, ParticleRange range,
                    float* energy) {
  for (std::size_t first = range.begin; first < range.end; first += kLanes) {
    const Batch b = batch_at(range, first);
    const Deformation d = deformation_of(load_mat3(p.F, b, 1.f));
    const Floats jp = load(p.Jp, b, 1.f);
    Floats psi = splat(0.f);
    for_each_object(materials, p.object, b,
                    [&](auto model, const MaterialParams& params, Mask mask)
                        FIRN_INLINE_LAMBDA { psi = select(mask, model.energy(params, d, jp), psi); });
    store_first(energy + (first - range.begin), b.count, psi);
  }
}

void stress(const MaterialParams* materials, const ParticleView& p, ParticleRange range, float* tau,
            std::size_t stride) {
  for (std::size_t first = range.begin; first < range.end; first += kLanes) {
    const Batch b = batch_at(range, first);
    const Deformation d = deformation_of(load_mat3(p.F, b, 1.f));
    const Floats jp = load(p.Jp, b, 1.f), zero = splat(0.f);
    Sym3 t{zero, zero, zero, zero, zero, zero};
    for_each_object(materials, p.object, b,
                    [&](auto model, const MaterialParams& params, Mask mask)
                        FIRN_INLINE_LAMBDA { t = select(mask, model.stress(params, 1.f, d, jp), t); });
    const Floats parts[6] = {t.xx, t.yy, t.zz, t.xy, t.xz, t.yz};
    for (int k = 0; k < 6; ++k) store_first(tau + k * stride + (first - range.begin), b.count, parts[k]);
  }
}

int project(const MaterialParams* materials, const ParticleView& p, ParticleRange range) {
  Summary summary;
  for (std::size_t first = range.begin; first < range.end; first += kLanes) {
    const Batch b = batch_at(range, first);
    Mat3 f = load_mat3(p.F, b, 1.f);
    Floats jp = load(p.Jp, b, 1.f);
    for_each_object(materials, p.object, b,
                    [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                      if (!params.plastic) return;
                      const Mask yielding = mask & model.yields(params, deformation_of(f), jp);
                      if (any(yielding)) summary.add_clamped(model.project(params, f, jp, yielding), b.count);
                    });
    store_mat3(p.F, b, f);
    store_first(p.Jp + b.first, b.count, jp);
  }
  BlockSummary out;
  summary.write(out);
  return out.clamped;
}

void svd(const float* const f[9], std::size_t count, float* const u[9], float* const s[3],
         float* const v[9]) {
  for (std::size_t first = 0; first < count; first += kLanes) {
    const Batch b = batch_at({0, count}, first);
    Mat3 a;
    for (int i = 0; i < 9; ++i) a.m[i] = load(f[i], b, i % 4 == 0 ? 1.f : 0.f);
    Svd3 d;
    svd3(a, d);
    for (int c = 0; c < 3; ++c) {
      const Floats uc[3] = {d.u[c].x, d.u[c].y, d.u[c].z}, vc[3] = {d.v[c].x, d.v[c].y, d.v[c].z};
      for (int r = 0; r < 3; ++r) {
        store_first(u[3 * r + c] + first, b.count, uc[r]);
        store_first(v[3 * r + c] + first, b.count, vc[r]);
      }
      store_first(s[c] + first, b.count, d.s[c]);
    }
  }
}

}  // namespace firn::kernels::FIRN_ISA
