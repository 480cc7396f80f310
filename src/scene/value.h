// SPDX-License-Identifier: MIT
// Values of code as values of the TOML tree.
#pragma once
#include <string>

#include "firn/scene.h"
#include "src/scene/toml_text.h"

namespace firn {

// Everything in it is placed at `where`. Errors: usage Error for a key that is given twice in a table.
RawValue raw(const Value& value, const std::string& where);

}  // namespace firn
