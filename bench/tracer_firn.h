// SPDX-License-Identifier: MIT
#pragma once
#include <vector>

#include "bench/tracer.h"
#include "kernels/table.h"
#include "src/render/snow/render_grid.h"

namespace firn::bench {

// The product: its render grid and its kernels.
class FirnTracer : public Tracer {
 public:
  // Balls of `radius` particle spacings.
  FirnTracer(const Snapshot& snapshot, double radius, const kernels::KernelTable& kernels);

  const char* name() const override { return "firn"; }
  void build() override { grid_.build(snapshot_, looks_); }
  Vec3 origin() const override { return grid_.origin(); }
  void trace(RayKind kind, const kernels::RayView& rays, std::size_t begin, std::size_t end) override;
  Vec3f center(std::uint32_t hit) const override {
    const kernels::TraceGrid& grid = grid_.view();
    return {grid.x[hit], grid.y[hit], grid.z[hit]};
  }
  std::size_t bytes() const override { return grid_.bytes(); }

  // m, of each particle's ball, in snapshot order, after build().
  std::vector<float> radii() const;

 private:
  const Snapshot& snapshot_;
  const kernels::TraceKernels& kernels_;
  std::vector<SnowLook> looks_;
  RenderGrid grid_{kernels_};
};

}  // namespace firn::bench
