// SPDX-License-Identifier: MIT
// Pictures of programs that use firn, which may be anything: they are checked, and written as files.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "firn/error.h"
#include "src/io/exr.h"
#include "src/io/file.h"
#include "src/io/images.h"

namespace firn {
namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Error(ErrorCode::usage, where, what);
}

void check(const Picture& picture, const ToneMapping& tone) {
  if (picture.width <= 0 || picture.height <= 0) refuse("picture", "it has no pixels");
  const std::size_t pixels = static_cast<std::size_t>(picture.width) * picture.height;
  const auto require = [&](const std::string& name, std::size_t values, int channels) {
    if (values == pixels * channels) return;
    refuse("picture", std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                          " pixels have " + std::to_string(pixels * channels) + " values of " + name +
                          ", not " + std::to_string(values));
  };
  require("rgb", picture.rgb.size(), 3);
  for (const LayerImage& layer : picture.layers)
    require(layer_name(layer.layer), layer.values.size(), channels_of(layer.layer));
  if (!std::isfinite(tone.exposure)) refuse("exposure", "it must be a finite number of stops");
}

// "PNG" of "a.b.PNG" in small letters; empty: none.
std::string ending(const std::filesystem::path& file) {
  std::string format = file.extension().string();
  if (!format.empty()) format.erase(0, 1);
  std::transform(format.begin(), format.end(), format.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return format;
}

}  // namespace

std::vector<std::uint8_t> tone_mapped(const Picture& picture, const ToneMapping& tone) {
  check(picture, tone);
  return to_image8(picture, tone).rgb;
}

std::vector<std::string> write_picture(const Picture& picture, const std::string& file,
                                       const ToneMapping& tone) {
  check(picture, tone);
  const std::filesystem::path path = file;
  const std::string format = ending(path);
  if (format != "png" && format != "ppm" && format != "pfm" && format != "exr")
    refuse(file, "the name of a picture file ends in .png, .ppm, .pfm or .exr");
  if (format == "exr" && !has_exr())
    refuse(file, "this firn was built without OpenEXR and cannot write .exr; .pfm holds the same layers");
  std::vector<std::string> written;
  for (const PictureFile& part : encode_picture(picture, format, tone)) {
    // The picture itself has the very name that was given.
    std::filesystem::path name = path;
    if (!written.empty()) name.replace_extension("." + part.extension);
    write_file(replaceable(name), part.bytes);
    written.push_back(name.string());
  }
  return written;
}

}  // namespace firn
