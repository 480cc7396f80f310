// SPDX-License-Identifier: MIT
#include "tests/kernels/lane_parts.h"

#include "kernels/mpm/materials.h"
#include "kernels/mpm/summary.h"
#include "kernels/simd/eigenvalues3.h"

namespace firn::kernels::FIRN_ISA {

namespace {

void eigenvalues(const float* const a[6], std::size_t count, float* const out[3]) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    Floats e[3];
    eigenvalues3(
        {load(a[0] + i), load(a[1] + i), load(a[2] + i), load(a[3] + i), load(a[4] + i), load(a[5] + i)}, e);
    for (int k = 0; k < 3; ++k) store(out[k] + i, e[k]);
  }
}

int project_all(const MaterialParams* materials, const ParticleView& p, ParticleRange range) {
  Summary summary;
  for (std::size_t first = range.begin; first < range.end; first += kLanes) {
    const Batch b = batch_at(range, first);
    Mat3 f = load_mat3(p.F, b, 1.f);
    Floats jp = load(p.Jp, b, 1.f);
    for_each_object(materials, p.object, b,
                    [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                      if (params.plastic) summary.add_clamped(model.project(params, f, jp, mask), b.count);
                    });
    store_mat3(p.F, b, f);
    store_first(p.Jp + b.first, b.count, jp);
  }
  BlockSummary out;
  summary.write(out);
  return out.clamped;
}

}  // namespace

LaneParts lane_parts() { return {eigenvalues, project_all}; }

}  // namespace firn::kernels::FIRN_ISA
