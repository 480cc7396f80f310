// SPDX-License-Identifier: MIT
// Image files that a scene names.
#pragma once
#include <memory>
#include <string>

#include "src/render/solids/image_texture.h"
#include "src/scene/config.h"

namespace firn {

// PFM as linear radiance or reflectance; PNG and PPM by the sRGB transfer. Errors: those of io/images, at the
// place of `key` in `table`; usage Error for values that are negative or not finite.
std::shared_ptr<const ImageTexture> load_texture(const SceneConfig& scene, const std::string& table,
                                                 const std::string& key, const std::string& file);

}  // namespace firn
