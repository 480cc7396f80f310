// SPDX-License-Identifier: MIT
#include "src/scene/load_texture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "firn/error.h"
#include "src/io/images.h"
#include "src/scene/validate.h"

namespace firn {
namespace {

ImageTexture linear(const Picture& picture) {
  ImageTexture texture{picture.width, picture.height, {}};
  for (std::size_t k = 0; k < picture.rgb.size(); k += 3)
    texture.rgb.emplace_back(picture.rgb[k], picture.rgb[k + 1], picture.rgb[k + 2]);
  return texture;
}

ImageTexture linear(const Image8& image) {
  ImageTexture texture{image.width, image.height, {}};
  for (std::size_t k = 0; k < image.rgb.size(); k += 3)
    texture.rgb.emplace_back(srgb8_to_linear(image.rgb[k]), srgb8_to_linear(image.rgb[k + 1]),
                             srgb8_to_linear(image.rgb[k + 2]));
  return texture;
}

ImageTexture load(const std::string& file) {
  if (std::filesystem::path(file).extension() != ".pfm") return linear(read_image8(file));
  ImageTexture texture = linear(read_pfm(file));
  const auto fine = [](const Vec3f& rgb) { return rgb.allFinite() && rgb.minCoeff() >= 0; };
  if (!std::all_of(texture.rgb.begin(), texture.rgb.end(), fine))
    throw Error(ErrorCode::usage, file, "a value is negative or not finite");
  return texture;
}

}  // namespace

std::shared_ptr<const ImageTexture> load_texture(const SceneConfig& scene, const std::string& table,
                                                 const std::string& key, const std::string& file) {
  try {
    return std::make_shared<ImageTexture>(load(file));
  } catch (const Error& error) {
    throw Error(error.code(), place_of(scene, table, key), error.what());
  }
}

}  // namespace firn
