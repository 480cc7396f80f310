// SPDX-License-Identifier: MIT
// How large the cells of a frame's render grid are and where they lie: Snapshot -> ball radii, bounds ->
// cells. The cell follows the mean particle spacing. It grows only when the table of bricks or the list of
// strays would have no bound, and a few particles that flew far away do not make it grow.
#pragma once
#include <cstddef>
#include <vector>

#include "firn/snapshot.h"
#include "kernels/trace/table.h"
#include "src/render/setup.h"

namespace firn {

inline constexpr std::size_t kParticleChunk = 8192;  // particles, or cells, that one task takes

// The radius of each particle's ball: its look's share of its spacing, the cube root of its volume. Remembers
// the last, since neighbours are mostly alike; copy it for a loop of one's own.
class BallSizes {
 public:
  BallSizes() = default;
  explicit BallSizes(const std::vector<SnowLook>& looks) : looks_(&looks) {}
  float radius(const Snapshot& snapshot, std::size_t i) {  // m
    if (!alike_ && (snapshot.volume0[i] != volume_ || snapshot.object[i] != object_)) remember(snapshot, i);
    return radius_;
  }
  // All balls are like that of the particle last asked for.
  void settle() { alike_ = true; }
  bool alike() const { return alike_; }
  double spacing() const { return spacing_; }  // m, of the particle last asked for

 private:
  void remember(const Snapshot& snapshot, std::size_t i);

  const std::vector<SnowLook>* looks_ = nullptr;
  float volume_ = -1, radius_ = 0;
  std::uint16_t object_ = 0;
  bool alike_ = false;
  double spacing_ = 0;
};

struct GridLayout {
  Vec3 origin = Vec3::Zero();  // m, world place of the render space's 0: the lower corner of the cells
  float shift[3] = {0, 0, 0};  // m, from the snapshot's positions to render space
  double spacing = 1;          // m, mean particle spacing
  double cell = 1;             // m
  int bricks[3] = {0, 0, 0};   // of 4x4x4 cells
  float size[3] = {0, 0, 0};   // m, of all cells
  BallSizes sizes;
  bool radii_fit = true;  // no ball is too large for the cells

  Vec3f local(const Snapshot& snapshot, std::size_t i) const {
    return {snapshot.position[0][i] + shift[0], snapshot.position[1][i] + shift[1],
            snapshot.position[2][i] + shift[2]};
  }
  // The largest radius that a ball in the cells may have, m.
  float largest_radius() const;
  // Whether a ball belongs into the cells; else it is a stray: too large or too far.
  bool holds(const Vec3f& local, float ball_radius) const;
};

// An unstable Error if a position or volume is not finite.
GridLayout lay_out_grid(const kernels::TraceKernels& kernels, const Snapshot& snapshot,
                        const std::vector<SnowLook>& looks);

}  // namespace firn
