// SPDX-License-Identifier: MIT
// Small scenes and pictures for the light suite.
#pragma once
#include <cstdint>

#include "firn/snapshot.h"
#include "src/core/isa.h"
#include "src/render/frame_tracer.h"

namespace firn::test {

// A jittered lattice of `spacing` that fills a ball.
Snapshot snowball(const Vec3& center, double radius, double spacing, const Vec3& origin = Vec3::Zero());

// Camera and film; nothing to see yet.
RenderSetup empty_setup(const Vec3& position, const Vec3& target, double fov, int size, int samples,
                        int bounces);
// Adds a surface and returns its index.
int add_surface(RenderSetup& setup, SurfaceKind kind, float grey);
void add_object(RenderSetup& setup, const Shape& shape, int surface);
Shape floor_plane(double height);

Picture render(const Snapshot& snapshot, const RenderSetup& setup, const kernels::KernelTable& kernels);
Picture render(const Snapshot& snapshot, const RenderSetup& setup);  // with the best kernels
Vec3f mean(const Picture& film);
std::uint64_t hash(const Picture& film);

// Renders with 1, 2 and 4 threads, on x86-64-v3 and v4: all must be the same bits.
void require_same_bits(const Snapshot& snapshot, const RenderSetup& setup);

}  // namespace firn::test
