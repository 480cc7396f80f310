// SPDX-License-Identifier: MIT
// A scene made in code and stepped by the program: a snowball falls; its height and energy, frame by frame.
//   falling_ball
#include <firn/firn.h>

#include <cstdio>

int main() try {
  firn::Scene scene("drop");
  scene.set("simulation.dx", 0.02).set("ground.friction", 0.4);
  scene.add("snow", {{"shape", "ball"}, {"radius", 0.1}, {"center", {0, 0.5, 0}}, {"velocity", {0, -1, 0}}});

  firn::Simulation simulation(scene);
  std::printf("%8s %10s %14s %10s\n", "time s", "height m", "kinetic J", "steps");
  for (int frame = 0; frame <= 12; ++frame) {
    simulation.advance_to(frame / 24.0);
    const firn::Metrics m = simulation.metrics();
    const double height = 0.5 * (m.bounds_min[1] + m.bounds_max[1]);  // of the middle
    std::printf("%8.4f %10.4f %14.6f %10llu\n", m.time, height, m.kinetic_energy,
                static_cast<unsigned long long>(m.steps));
  }
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
