// SPDX-License-Identifier: MIT
// Scenes of a few thousand particles for the tests of simulations.
#pragma once
#include "firn/firn.h"

namespace firn::test {

inline constexpr double kDx = 0.02;  // m
inline constexpr double kGravity = 9.81;

// A box of snow that lies on the ground, and whatever else is added.
inline Scene bed(const Vector3& size = {0.2, 0.12, 0.2}) {
  Scene scene("bed");
  scene.set("simulation.dx", kDx).set("ground.friction", 0.5);
  scene.add("snow", {{"name", "bed"},
                     {"shape", "box"},
                     {"size", {size[0], size[1], size[2]}},
                     {"center", {0, 0.5 * size[1], 0}}});
  return scene;
}

inline const Table kBall = {
    {"shape", "ball"}, {"radius", 0.05}, {"center", {0, 0.25, 0}}, {"velocity", {0, -3, 0}}};

inline Scene with_plate(double turn = 0) {
  Scene scene = bed();
  scene.add("collider", {{"name", "plate"},
                         {"shape", "box"},
                         {"size", {0.1, 0.3, 0.3}},
                         {"center", {-0.2, 0.2, 0}},
                         {"rotation", {0, turn, 0}}});
  return scene;
}

inline SimulationOptions on(int threads) {
  SimulationOptions options;
  options.threads = threads;
  return options;
}

}  // namespace firn::test
