// SPDX-License-Identifier: MIT
// Colliders whose motion a program decides step by step.
#pragma once
#include <functional>
#include <string>

#include "firn/vector.h"

namespace firn {

// A collider between two steps. World axes.
struct DrivenCollider {
  std::string name;               // as in the scene
  double time = 0;                // s, now
  Vector3 position{};             // m, of the pivot: the place where its shape is put
  Matrix3 rotation = kIdentity3;  // from how the shape was put
  Vector3 velocity{};             // m/s, of the pivot during the last step
  Vector3 angular_velocity{};     // rad/s
  double dt = 0;                  // s, how long the last step was; 0: there was none
  // N, of the snow on the collider, where metrics tell that of the collider on the snow: the mean over the
  // last step.
  Vector3 force{};
  Vector3 torque{};  // N m, about the pivot

  friend bool operator==(const DrivenCollider&, const DrivenCollider&) = default;
};

// How the collider is to move during the next step.
struct ColliderVelocity {
  Vector3 linear{};   // m/s, of the pivot
  Vector3 angular{};  // rad/s
};

// May look at its simulation (metrics, snapshot, save), but not step or change it.
using ColliderDriver = std::function<ColliderVelocity(const DrivenCollider&)>;

}  // namespace firn
