// SPDX-License-Identifier: MIT
// Particles and rays for the trace suite, all from fixed seeds, and the judgement of a kernel's answer.
#pragma once
#include <string>
#include <vector>

#include "firn/snapshot.h"
#include "kernels/reference/trace.h"
#include "kernels/table.h"
#include "src/core/isa.h"
#include "src/render/columns/ray_stream.h"
#include "src/render/snow/render_grid.h"

namespace firn::test {

inline const kernels::TraceKernels& best_trace() { return supported_kernels().back()->trace; }

// `count` particles of spacing about 1 in a cube that they fill; volumes differ by `uneven` (1: equal).
Snapshot cloud(std::size_t count, std::uint64_t seed, double uneven = 1);
// A ball of particles at spacing 1, jittered by a quarter of it: eight to a cell of the simulation.
Snapshot lattice_ball(double radius, const Vec3& center = Vec3::Zero(), double jitter = 0.25);
void add_particle(Snapshot& snapshot, const Vec3& world, double spacing);

enum class RayKind { random, axis_parallel, grazing, inside, on_surface, far_away };
inline constexpr RayKind kAllKinds[] = {RayKind::random, RayKind::axis_parallel, RayKind::grazing,
                                        RayKind::inside, RayKind::on_surface,    RayKind::far_away};

// Rays in the grid's render space that are aimed at or near its balls.
RayStream make_rays(const RenderGrid& grid, RayKind kind, std::size_t count, std::uint64_t seed);

using TraceFunction = void (*)(const kernels::TraceGrid&, const kernels::RayView&, std::size_t, std::size_t);

// Empty if every answer is right up to rounding, else what is wrong with the first bad one. A ray that grazes
// a ball may go either way; anything else must agree with the reference.
std::string judge_closest(TraceFunction closest, const RenderGrid& grid, RayStream rays);
std::string judge_occluded(TraceFunction occluded, const RenderGrid& grid, RayStream rays);

}  // namespace firn::test
