// SPDX-License-Identifier: MIT
// Scenes that stand for what is rendered most, small: for what must hold of any picture.
#pragma once
#include <string>
#include <vector>

#include "tests/light/pictures.h"

namespace firn::test {

struct Scene {
  std::string name;
  RenderSetup setup;  // 16 samples
  Snapshot snapshot;
};

// A matt ball under sun and sky, snow in a lit room, snow that glints in the sun; size x size pixels.
std::vector<Scene> small_scenes(int size);

}  // namespace firn::test
