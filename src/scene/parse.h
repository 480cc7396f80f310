// SPDX-License-Identifier: MIT
// From the TOML tree to a SceneConfig, key by key along the schema.
#pragma once
#include <string>

#include "src/scene/config.h"
#include "src/scene/toml_text.h"

namespace firn {

// Errors: usage Error at the place of an unknown key, a wrong type, a value out of range, a key that does not
// belong to the shape or type of its table, or a table that lacks a required key.
SceneConfig parse_scene(const RawTable& root, const std::string& file);

}  // namespace firn
