// SPDX-License-Identifier: MIT
// Scenes written inside a test.
#pragma once
#include <string>
#include <vector>

#include "src/scene/scene.h"

namespace firn::test {

// Four lines: what is added to it begins on line 5.
inline const std::string kBall =
    "[[snow]]\n"
    "shape = \"ball\"\n"
    "center = [0.0, 0.5, 0.0]\n"
    "radius = 0.1\n";

inline SceneConfig read(const std::string& text, std::vector<SceneOverride> overrides = {},
                        bool quick = false) {
  return read_scene_text(text, "scene.toml", {quick, std::move(overrides)});
}

}  // namespace firn::test
