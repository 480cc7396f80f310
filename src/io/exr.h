// SPDX-License-Identifier: MIT
// OpenEXR files: the beauty as R, G, B and each layer beside it as albedo.R, normal.X, depth.Z, ... in 32-bit
// floats, without exposure. Only where OpenEXR was found when firn was built.
#pragma once
#include <string>

#include "firn/picture.h"

namespace firn {

bool has_exr();  // whether this program can write them

// The file's bytes. Errors: failed Error if it was built without OpenEXR.
std::string encode_exr(const Picture& picture);

}  // namespace firn
