// SPDX-License-Identifier: MIT
// What the trace benchmark asks of anything that traces rays against balls: firn, or a rival.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "firn/snapshot.h"
#include "kernels/table.h"
#include "src/core/vector.h"

namespace firn::bench {

enum class RayKind { primary, shadow, bounce };
inline constexpr RayKind kRayKinds[] = {RayKind::primary, RayKind::shadow, RayKind::bounce};
inline constexpr std::size_t kRayKindCount = 3;

class Tracer {
 public:
  virtual ~Tracer() = default;
  virtual const char* name() const = 0;

  // Starts a new frame: all that tracing needs is made anew of the snapshot.
  virtual void build() = 0;
  // World place (m) of the 0 of the space that rays are in.
  virtual Vec3 origin() const = 0;
  // Rays [begin, end), as kernels::TraceKernels has it: the nearest hit, or of shadow rays whether there is
  // one. Neighbours in the columns are neighbours on the film. `hit` is the tracer's own name for the ball.
  virtual void trace(RayKind kind, const kernels::RayView& rays, std::size_t begin, std::size_t end) = 0;
  // Centre (m, ray space) of a ball that was hit.
  virtual Vec3f center(std::uint32_t hit) const = 0;
  // Bytes held beside the snapshot.
  virtual std::size_t bytes() const = 0;

  // Names of the ways in which it can trace, and which to take for rays of a kind.
  virtual std::vector<std::string> ways() const { return {}; }
  virtual void choose(RayKind, std::size_t) {}
};

}  // namespace firn::bench
