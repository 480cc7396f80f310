// SPDX-License-Identifier: MIT
// --set and [quick]: values written into the TOML tree before it is parsed, so that they pass the same
// checks.
#pragma once
#include "src/scene/scene.h"
#include "src/scene/toml_text.h"

namespace firn {

// Moves the values of the [quick] table to their places and takes the table out. Errors: usage Error at the
// quick key.
void apply_quick(RawTable& root);

// Errors: usage Error "--set snow.radius: ...".
void apply_override(RawTable& root, const SceneOverride& change);

// The value at the places that the path names. Errors: usage Error at the value's place.
void set_value(RawTable& root, const std::string& path, const RawValue& value);

// One more table of a list. Errors: usage Error at the table's place.
void add_table(RawTable& root, const std::string& list, RawValue table);

}  // namespace firn
