// SPDX-License-Identifier: MIT
// What no single key can show: contradictions between keys, names that lead nowhere, files that are missing.
#pragma once
#include <cstddef>
#include <string>

#include "src/scene/config.h"

namespace firn {

// Errors: usage Error, or io Error for a missing file, at the place of the offending key.
void validate(const SceneConfig& scene);

// The first light of type "sun", or null.
const LightConfig* first_sun(const SceneConfig& scene);

// The path of a table of a list: "snow[2]".
std::string table_of(const std::string& list, std::size_t index);
// Where a key was written, or else its table, or else the file: "snow[0]", "radius".
std::string place_of(const SceneConfig& scene, const std::string& table, const std::string& key = "");

}  // namespace firn
