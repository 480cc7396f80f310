// SPDX-License-Identifier: MIT
// Particles of a range whose F lies outside their yield surface, collected until they fill a register. A
// particle's result does not depend on its company, so neither grouping nor order changes a bit.
#pragma once
#include "kernels/mpm/materials.h"
#include "kernels/mpm/summary.h"

namespace firn::kernels::FIRN_ISA {

// J per m^3 of placed volume that yielding from F = `trial` to `d` takes away: the stress, which stands on
// the yield surface, times the plastic strain, tau : (trial - F) F^-1; less what hardening adds to the
// elastic energy. The difference of the elastic energies would count the trial's overshoot beyond the surface
// too, which is an error of the time step and not the snow's.
template <class Model>
FIRN_INLINE Floats plastic_work(Model, const MaterialParams& params, const Mat3& trial, Floats trial_jp,
                                const Deformation& d, Floats jp) {
  const Sym3 tau = Model::stress(params, 1.f, d, trial_jp);
  Floats work = splat(0.f);
#pragma GCC unroll 3
  for (int k = 0; k < 3; ++k) {  // J times row k of F^-1 is the cross product of the other two columns
    const Vec3 across = cross(column(d.f, (k + 1) % 3), column(d.f, (k + 2) % 3));
    work = work + dot(column(trial, k) - column(d.f, k), times(tau, across));
  }
  return work / d.j + (Model::energy(params, d, trial_jp) - Model::energy(params, d, jp));
}

class YieldingList {
 public:
  explicit YieldingList(std::size_t range_begin) : begin_(range_begin) {}

  bool fills_register() const { return count_ >= kLanes; }

  // Takes at most kLanes particles more; fills_register() must be false.
  FIRN_INLINE void add(const ParticleView& p, Batch b, const Mat3& f, Floats jp, Mask yields) {
    const std::uint32_t* objects = p.object + b.first;
    const Ints object = load_first(reinterpret_cast<const std::int32_t*>(objects), b.count, 0);
    store_packed(particle_ + count_, yields, lane_numbers() + static_cast<std::int32_t>(b.first - begin_));
    store_packed(object_ + count_, yields, object);
#pragma GCC unroll 9
    for (int k = 0; k < 9; ++k) store_packed(column_[k] + count_, yields, f.m[k]);
    store_packed(column_[9] + count_, yields, jp);
    count_ += __builtin_popcount(static_cast<unsigned>(lane_bits(yields)));
  }

  // Projects the last particles of the list, at most kLanes, and takes them off it.
  FIRN_INLINE void project_last(const StepParams& step, const MaterialParams* materials,
                                const ParticleView& p, Summary& summary) {
    const int many = count_ < kLanes ? count_ : kLanes;
    count_ -= many;
    if (many < kLanes) pad(many);
    Mat3 f;
#pragma GCC unroll 9
    for (int k = 0; k < 9; ++k) f.m[k] = load(column_[k] + count_);
    Floats jp = load(column_[9] + count_), wave2 = splat(0.f), work = splat(0.f);  // work: J/kg
    for_each_object(materials, object_ + count_, load(object_ + count_),
                    [&](auto model, const MaterialParams& params, Mask mask) FIRN_INLINE_LAMBDA {
                      const Mat3 trial = f;
                      const Floats trial_jp = jp;
                      summary.add_clamped(model.project(params, f, jp, mask), many);
                      const Deformation d = deformation_of(f);
                      wave2 = select(mask, model.wave_speed2(params, d, jp), wave2);
                      const Floats done = plastic_work(model, params, trial, trial_jp, d, jp);
                      work = select(mask, done * splat(params.inverse_density), work);
                    });
    summary.add_wave_speed(wave2);
#pragma GCC unroll 9
    for (int k = 0; k < 9; ++k) write_back(f.m[k], many, p.F[k]);
    write_back(jp, many, p.Jp);
    add_work(step, p, work, many, summary);
  }

  FIRN_INLINE void project_rest(const StepParams& step, const MaterialParams* materials,
                                const ParticleView& p, Summary& summary) {
    if (count_ > 0) project_last(step, materials, p, summary);
  }

 private:
  // Repeats the first particle in the lanes from `many` on.
  void pad(int many) {
    for (int l = many; l < kLanes; ++l) {
      object_[l] = object_[0];
      for (auto& column : column_) column[l] = column[0];
    }
  }

  FIRN_INLINE void write_back(Floats a, int many, float* column) const {
    alignas(64) float lanes[kLanes];
    store(lanes, a);
    for (int l = 0; l < many; ++l)
      column[begin_ + static_cast<std::size_t>(particle_[count_ + l])] = lanes[l];
  }

  FIRN_INLINE void add_work(const StepParams& step, const ParticleView& p, Floats work, int many,
                            Summary& summary) const {
    alignas(64) float lanes[kLanes];
    store(lanes, work);
    for (int l = 0; l < many; ++l) {
      const double mass = p.m[begin_ + static_cast<std::size_t>(particle_[count_ + l])];
      summary.add_plastic_work(mass * static_cast<double>(lanes[l]), step.work_quanta);
    }
  }

  static constexpr int kCapacity = 3 * kLanes;  // the last kLanes are room for what store_packed overwrites
  std::size_t begin_;
  int count_ = 0;
  std::int32_t particle_[kCapacity], object_[kCapacity];  // particle: from the range's begin
  float column_[10][kCapacity];                           // F, Jp
};

}  // namespace firn::kernels::FIRN_ISA
