// SPDX-License-Identifier: MIT
#include "src/mpm/frame.h"

#include "src/core/parallel.h"

namespace firn {

void into_frame(const Pose& frame, PlacedSnow& snow) {
  const Mat3 to_local = frame.rotation.transpose();
  parallel_for(snow.position.size(), 4096, [&](std::size_t i) {
    snow.position[i] = frame.to_local(snow.position[i]);
    snow.velocity[i] = to_local * snow.velocity[i];
  });
  for (Eigen::Matrix3f& F : snow.strain) F = (to_local * F.cast<double>() * frame.rotation).cast<float>();
}

SolverSetup in_frame(SolverSetup setup) {
  if (!setup.frame) return setup;
  const Pose& frame = *setup.frame;
  const Mat3 to_local = frame.rotation.transpose();
  setup.gravity = to_local * setup.gravity;
  for (PlacedSnow& snow : setup.snow) into_frame(frame, snow);
  for (Collider& collider : setup.colliders) {
    collider.shape.pose = frame.to_local(collider.shape.pose);
    collider.motion = collider.motion.seen_from(frame);
  }
  if (setup.domain) setup.domain->pose = frame.to_local(setup.domain->pose);
  return setup;
}

}  // namespace firn
