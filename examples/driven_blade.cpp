// SPDX-License-Identifier: MIT
// A collider whose motion the program decides in each step from the force on it: a blade of 20 kg is pushed
// into a bank of snow with 400 N, and slows down as the snow piles up before it.
//   driven_blade
#include <firn/firn.h>

#include <cstdio>

int main() try {
  firn::Scene scene("blade");
  scene.set("simulation.dx", 0.03).set("ground.friction", 0.5);
  scene.add("snow", {{"shape", "box"}, {"size", {0.6, 0.2, 0.3}}, {"center", {0.5, 0.1, 0}}});
  scene.add("collider", {{"name", "blade"},
                         {"shape", "box"},
                         {"size", {0.1, 0.4, 0.5}},
                         {"center", {0.05, 0.25, 0}},
                         {"contact", "separating"}});

  firn::Simulation simulation(scene);
  constexpr double mass = 20, push = 400;  // kg, N
  double speed = 0;                        // m/s
  firn::DrivenCollider blade;
  // Called before each step; `dt` and `force` are those of the step that has just ended.
  simulation.drive("blade", [&](const firn::DrivenCollider& now) {
    blade = now;
    speed += now.dt * (push + now.force[0]) / mass;
    return firn::ColliderVelocity{{speed, 0, 0}, {}};
  });
  std::printf("%8s %10s %10s %12s %14s\n", "time s", "blade m", "m/s", "snow N", "torque z N m");
  for (int frame = 1; frame <= 10; ++frame) {
    simulation.advance_to(frame * 0.03);
    // As it was told before the last step.
    std::printf("%8.4f %10.4f %10.4f %12.2f %14.3f\n", blade.time, blade.position[0], blade.velocity[0],
                blade.force[0], blade.torque[2]);
  }
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
