// SPDX-License-Identifier: MIT
// Points of another program, here the arrays of a snowy heart, rendered with the optics of snow: a picture as
// an array, and as a file.
//   points [PICTURE.png]
#include <firn/firn.h>

#include <algorithm>
#include <cstdio>

namespace {

// Within the heart surface of Taubin (1994), about 1 m high.
bool in_heart(double x, double y, double z) {
  const double a = x * x + 2.25 * z * z + y * y - 1;
  return a * a * a - x * x * y * y * y - 0.1125 * z * z * y * y * y < 0;
}

}  // namespace

int main(int count, char** words) try {
  constexpr double spacing = 0.02;  // m
  firn::Points points;
  for (double x = -0.7; x < 0.7; x += spacing) {
    for (double y = -0.7; y < 0.7; y += spacing) {
      for (double z = -0.4; z < 0.4; z += spacing) {
        if (in_heart(2 * x, 2 * y, 2 * z)) points.position.push_back({x, y + 0.6, z});
      }
    }
  }
  points.volume = {spacing * spacing * spacing};  // one number for all

  firn::Scene scene("heart");
  scene.add_points(points, {{"preset", "fresh"}}).set("ground.friction", 0.5);
  scene.set("camera.position", {0.8, 1.0, 2.6}).set("camera.target", {0, 0.55, 0});
  scene.set("image.width", 240).set("image.height", 240).set("image.samples", 16);

  const firn::Snapshot snow = firn::Simulation(scene).snapshot();  // or any later moment
  firn::Renderer renderer(scene);
  const firn::Picture picture = renderer.render(snow);
  std::printf("%zu points, %d x %d pixels, brightest %.3f\n", snow.size(), picture.width, picture.height,
              *std::max_element(picture.rgb.begin(), picture.rgb.end()));
  firn::write_picture(picture, count > 1 ? words[1] : "heart.png", renderer.tone_mapping());
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
