// SPDX-License-Identifier: MIT
// The particles as columns, and their state on request: where the snow is, how far it is packed and pressed.
//   particles
#include <firn/firn.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main() try {
  firn::Scene scene("pressed");
  scene.set("simulation.dx", 0.02).set("ground.friction", 0.4);
  scene.add("snow",
            {{"shape", "box"}, {"size", {0.2, 0.2, 0.2}}, {"center", {0, 0.1, 0}}, {"velocity", {0, -3, 0}}});
  firn::Simulation simulation(scene);
  simulation.advance_to(0.02);

  // A copy of the state: the simulation may go on, and the copy stays.
  const firn::Snapshot snow = simulation.snapshot({.F = true, .Jp = true, .J = true, .stress = true});
  std::printf("%zu particles at %.4f s; positions are relative to (%g, %g, %g) m\n", snow.size(), snow.time,
              snow.origin[0], snow.origin[1], snow.origin[2]);

  // One (3, particles) view: component k of particle i is position.data()[k * stride + i], or position[k][i].
  const float* const heights = snow.position.data() + snow.position.stride();
  std::printf("lowest and highest: %g %g m\n",
              snow.origin[1] + *std::min_element(heights, heights + snow.size()),
              snow.origin[1] + *std::max_element(heights, heights + snow.size()));

  double densest = 0, pressed = 0, most = 0;
  for (std::size_t i = 0; i < snow.size(); ++i) {
    const double pressure = -(snow.stress[0][i] + snow.stress[4][i] + snow.stress[8][i]) / 3;
    densest = std::max<double>(densest, snow.density[i]);
    pressed += pressure / snow.size();
    most = std::max(most, std::abs(1.0 - static_cast<double>(snow.J[i])));
  }
  std::printf("densest %.1f kg/m^3, mean pressure %.1f Pa, volumes changed by up to %.2f %%\n", densest,
              pressed, 100 * most);
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
