// SPDX-License-Identifier: MIT
// Snow that is added while a simulation is under way, and snow that is taken out of it.
//   snow_comes_and_goes
#include <firn/firn.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

int main() try {
  firn::Scene scene("snow_comes_and_goes");
  scene.set("simulation.dx", 0.02).set("ground.friction", 0.5);
  scene.add("snow", {{"shape", "box"}, {"size", {0.4, 0.08, 0.4}}, {"center", {0, 0.04, 0}}});
  firn::Simulation simulation(scene);

  for (int ball = 0; ball < 4; ++ball) {
    // As one more [[snow]] of the scene would be at its start. What would start in other snow is refused.
    simulation.add_snow({{"shape", "ball"},
                         {"radius", 0.05},
                         {"center", {0.1 * ball - 0.15, 0.3, 0.0}},
                         {"velocity", {0, -4, 0}}});
    simulation.advance_to(simulation.time() + 0.1);

    // Whatever has left the bed on its sides.
    const firn::Snapshot snow = simulation.snapshot();
    std::vector<std::uint32_t> gone;
    for (std::size_t i = 0; i < snow.size(); ++i) {
      const firn::Vector3 x = snow.world_position(i);
      if (std::max(std::abs(x[0]), std::abs(x[2])) > 0.21) gone.push_back(snow.id[i]);
    }
    const std::size_t removed = simulation.remove_snow(gone);
    std::printf("%.2f s: %zu particles, %zu taken out, %.3f kg\n", simulation.time(), simulation.size(),
                removed, simulation.metrics().mass);
  }
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
