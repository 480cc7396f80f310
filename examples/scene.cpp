// SPDX-License-Identifier: MIT
// A scene made in code: two snowballs of different snow fall on a slope, and a run makes a movie of it.
//   scene RUN_FOLDER
#include <firn/firn.h>

#include <cstdio>
#include <string>

int main(int count, char** words) try {
  if (count != 2) return std::fprintf(stderr, "usage: scene RUN_FOLDER\n"), 2;

  // The keys are those of scene files: `firn params` lists them.
  firn::Scene scene("slope");
  scene.set("time.frames", 5).set("time.fps", 25).set("simulation.dx", 0.02);
  scene.set("image.width", 160).set("image.height", 120).set("image.samples", 2);
  scene.set("camera.position", {-0.5, 0.7, 1.6}).set("camera.target", {0.1, 0.2, 0});
  for (const double x : {-0.2, 0.1}) {
    scene.add("snow", {{"name", x < 0 ? "powder" : "packed"},
                       {"shape", "ball"},
                       {"radius", 0.1},
                       {"center", {x, 0.45, 0.0}},
                       {"velocity", {0, -2, 0}},
                       {"young_modulus", x < 0 ? 5e4 : 2e5}});
  }
  scene.add("collider", {{"name", "slope"},
                         {"shape", "plane"},
                         {"point", {0, 0, 0}},
                         {"normal", {0.3, 1, 0}},
                         {"friction", 0.4}});

  firn::SessionOptions options;
  options.out = words[1];
  options.overwrite = true;
  firn::Session session = firn::Session::start(scene, options);
  session.run();
  std::printf("%d frames in %s\n", scene.frames(), session.folder().c_str());
} catch (const firn::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
