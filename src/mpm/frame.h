// SPDX-License-Identifier: MIT
// The simulation's own frame: local = R^-1 (world - T). With a domain box that is turned, the grid follows
// the box's axes, so that snow on a slope lies along the nodes and gravity pulls it aslant. Everything enters
// through in_frame() once, steps in local coordinates, and is turned back where metrics and snapshots leave.
// The columns of a checkpoint and the state's hash are local.
#pragma once
#include "src/mpm/solver.h"

namespace firn {

void into_frame(const Pose& frame, PlacedSnow& snow);

// The same scene as seen from setup.frame, which stays as it was.
SolverSetup in_frame(SolverSetup setup);

// Without a frame these change no bit.
inline Vec3 point_in_world(const std::optional<Pose>& frame, const Vec3& local) {
  return frame ? frame->to_world(local) : local;
}
inline Vec3 vector_in_world(const std::optional<Pose>& frame, const Vec3& local) {
  return frame ? Vec3(frame->rotation * local) : local;
}

}  // namespace firn
