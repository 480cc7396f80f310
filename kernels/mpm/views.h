// SPDX-License-Identifier: MIT
// What the MPM kernels read and write: plain data only, shared by every instruction set's build, without a
// function that could leak from one build into another.
//
// Lattice: positions are counted in cells, p = world / dx. Grid node n lies at p = n - 1/2, so a particle in
// cell c = floor(p) touches nodes c, c + 1, c + 2 on each axis (quadratic B-spline). Blocks are 4x4x4; block
// b owns cells and nodes 4b .. 4b + 3. A particle may drift one cell out of its block before it is sorted
// again, so a block's particles touch nodes -1 .. 6 of the block: the 8x8x8 tile.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/materials/list.h"

namespace firn::kernels {

inline constexpr int kBlockSide = 4;    // cells and nodes
inline constexpr int kBlockNodes = 64;  // z fastest
inline constexpr int kNodeFloats = 4;   // momentum or velocity x y z, mass
inline constexpr int kBlockFloats = kBlockNodes * kNodeFloats;
inline constexpr int kImpulseParts = 6;  // an impulse x y z and its moment x y z
inline constexpr int kTileSide = 8;
inline constexpr int kTileFloats = 2048;  // 8x8x8 nodes, z fastest
// One more cache line: the last stencil row reads one node too many (weight 0), and tiles do not alias.
inline constexpr int kTileStride = kTileFloats + 16;
inline constexpr int kNeighbours = 27;  // of a block: (dx+1)*9 + (dy+1)*3 + (dz+1)

// Positions are fixed-point, 2^-28 cells, relative to the block's corner: adding a displacement is exact to
// 4e-9 cells anywhere in the block, and moving a particle to another block changes no bit of where it is.
// Range +-8 cells.
inline constexpr int kCellBits = 28;
inline constexpr std::int32_t kOneCell = 1 << kCellBits;

// Particle columns. 3x3 matrices are row-major.
struct ParticleView {
  std::int32_t* x[3];  // 2^-28 cells from the block's corner
  float* v[3];         // m/s
  float* C[9];         // 1/s, APIC velocity gradient
  float* F[9];         // elastic deformation gradient
  float* Jp;           // plastic volume ratio: J |Jp| is the volume taken up; its sign: cam_clay.h
  float* m;            // kg
  std::uint32_t* id;
  std::uint32_t* object;  // index into the material table
};

struct ParticleRange {
  std::size_t begin, end;
};

struct StepParams {
  float dt;             // s
  float dx;             // m
  float inv_dx;         // 1/m
  float gravity_dt[3];  // m/s
  float mass_floor;     // kg; nodes below it carry rounding noise only and stand still
  double work_quanta;   // 1/J: plastic work is counted in whole ones, so that its sum has no order
};

// A node this near to a collider's surface (cells) lies on it, up to rounding, and touches.
inline constexpr float kTouchingCells = 1e-5f;

enum ContactKind : std::int32_t { kSticky, kSlip, kSeparating };

// What one collider is at the 64 nodes of one block. It is rigid, so its velocity is that at the block's
// first node plus turn x (offset from that node).
struct ContactNodes {
  std::int32_t collider;         // whose it is: its place among the impulses
  float distance[kBlockNodes];   // cells, negative inside
  float normal[3][kBlockNodes];  // outward
  ContactKind kind;
  float friction;         // Coulomb coefficient of what slides
  float static_friction;  // of what stands, >= friction
  std::int32_t moving;    // 0: `velocity` and `turn` have no meaning
  float velocity[3];      // m/s
  float turn[3];          // m/s a cell: the angular velocity times dx
};

// What G2P saw in one block: maxima (their order does not matter) that choose dt, and what must not be
// overlooked.
struct BlockSummary {
  float speed2;               // m^2/s^2, largest |v|^2
  float wave2;                // m^2/s^2, largest squared speed of elastic waves
  float rate2;                // 1/s^2, largest |C|_F^2
  std::int32_t strayed;       // some particle left the block's margin: sort before the next P2G
  std::int32_t not_finite;    // some particle has a NaN or an infinity
  std::int32_t clamped;       // particles whose F was clamped
  std::int64_t plastic_work;  // StepParams::work_quanta: what that took from their elastic energy
};

}  // namespace firn::kernels
