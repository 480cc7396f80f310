// SPDX-License-Identifier: MIT
// Picture files. PNG and PPM hold the developed 8-bit sRGB image (src/io/tone.h), PFM the linear film as it
// is. Encoders return the file's bytes, so that callers hash what they write; readers serve movies and tests.
#pragma once
#include <filesystem>
#include <string>

#include "src/io/tone.h"
#include "src/render/picture.h"

namespace firn {

std::string encode_png(const Image8& image);
std::string encode_ppm(const Image8& image);  // binary (P6)
std::string encode_pfm(
    const Picture& film);  // colour (PF), little-endian, bottom row first as the format has it

// `format` is "png", "ppm" or "pfm".
std::string encode_film(const Picture& film, const std::string& format, double exposure);

// Errors: io Error naming the file, for a file that is missing, of another format, damaged or too short.
Image8 read_png(const std::filesystem::path& path);
Image8 read_ppm(const std::filesystem::path& path);
Picture read_pfm(const std::filesystem::path& path);
Image8 read_image8(const std::filesystem::path& path);  // by extension: .png or .ppm

}  // namespace firn
