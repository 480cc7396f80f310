// SPDX-License-Identifier: MIT
// Colliders that a program drives: before each step it is asked how they are to move in it.
#pragma once
#include <cstddef>

#include "firn/driver.h"
#include "src/geometry/keyframes.h"
#include "src/mpm/contact_forces.h"

namespace firn {

struct Driven {
  std::size_t collider;
  ColliderDriver driver;                  // empty: it was driven before the state was loaded
  MotionKey begin, end;                   // of the motion that it has now; its step may end before `end`
  ColliderVelocity velocity;              // in the simulation's frame
  double dt = 0;                          // s, of the last step
  Impulse before;                         // on the snow in the interval, when the step began
  Impulse last;                           // and during it
  double longest_way = 0, top_speed = 0;  // m, m/s, where snow was: for the blow-up check
};

}  // namespace firn
