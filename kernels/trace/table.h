// SPDX-License-Identifier: MIT
// Rays against the particles of a uniform grid: the views that go in, the functions that answer.
// Ray space: metres, the grid's lower corner at 0. A particle is hit where a ray ENTERS its ball at a
// distance > 0: the inside of a ball is snow, not surface, so a ray that starts inside one does not see it.
// Two lists over the same sorted particles: `cell_start` (by centre: coherent packets, density) and `bundles`
// (every cell that a ball overlaps, 16 balls a bundle: incoherent rays read them without a gather).
#pragma once
#include <cstddef>
#include <cstdint>

namespace firn::kernels {

inline constexpr std::uint32_t kNoHit = 0xffffffffu;
inline constexpr std::uint32_t kNoBrick = 0xffffffffu;
inline constexpr int kBrickCells = 4;      // a brick is 4x4x4 cells
inline constexpr int kCellsPerBrick = 64;  // z fastest
inline constexpr int kRayLanes = 16;

// 16 balls; a place without a ball has r2 = -1 and is never hit.
struct alignas(64) BallBundle {
  float x[kRayLanes], y[kRayLanes], z[kRayLanes];  // m
  float r2[kRayLanes];                             // m^2
  std::uint32_t particle[kRayLanes];               // sorted index
};

struct TraceGrid {
  float cell = 1, inv_cell = 1;         // m, 1/m
  int cells[3] = {0, 0, 0};             // multiples of 4
  int bricks[3] = {0, 0, 0};            // z fastest
  const std::uint32_t* slot = nullptr;  // per brick: place among the occupied ones, or kNoBrick
  const std::uint8_t* clearance =
      nullptr;  // per empty brick: k >= 1, every brick closer than k (Chebyshev) is empty
  const std::uint64_t* bundle_start = nullptr;  // per cell of an occupied brick, one more at the end
  const BallBundle* bundles = nullptr;
  const std::uint8_t* core = nullptr;         // per occupied brick: 1 if it has no bundles
  const std::uint64_t* cell_start = nullptr;  // likewise, into the sorted columns
  const float *x = nullptr, *y = nullptr, *z = nullptr, *radius = nullptr;  // sorted particles, m
  float max_radius = 0;                // m, of the particles in the cells
  const BallBundle* strays = nullptr;  // too large or too far for the cells: every ray tests them
  std::uint64_t stray_bundles = 0;
};

// Columns of rays. Directions are unit vectors. `t` is the reach on entry (m, may be infinite) and the
// distance of the hit on return; `hit` is the sorted index of the particle or kNoHit, in which case t is
// unchanged.
struct RayView {
  const float* origin[3];
  const float* direction[3];
  float* t;
  std::uint32_t* hit;
};

struct TraceKernels {
  // The nearest hit of each ray in [begin, end); of equal distances the lowest index.
  void (*closest)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
  // The same bits, faster where neighbours in the columns are neighbours in space, as camera rays are.
  void (*closest_coherent)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
  // Any hit nearer than the reach: `hit` tells whether there is one, t is left alone.
  void (*occluded)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
};

}  // namespace firn::kernels
