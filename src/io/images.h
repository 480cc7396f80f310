// SPDX-License-Identifier: MIT
// Picture files. PNG and PPM hold the developed 8-bit sRGB image (src/io/tone.h), PFM and EXR
// (src/io/exr.h) the linear picture as it is, and its layers. Encoders return the file's bytes, so that
// callers hash what they write; readers serve movies and tests.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "firn/picture.h"
#include "src/io/tone.h"

namespace firn {

std::string encode_png(const Image8& image);
std::string encode_ppm(const Image8& image);  // binary (P6)
// Little-endian, bottom row first as the format has it; colour (PF) for 3 channels, grey (Pf) for 1.
std::string encode_pfm(int width, int height, int channels, const std::vector<float>& values);

struct PictureFile {
  std::string extension;  // "png", "albedo.pfm"
  std::string bytes;
};
// The files of a picture in one format, its beauty first. `format` is "png", "ppm", "pfm" or "exr".
std::vector<PictureFile> encode_picture(const Picture& picture, const std::string& format,
                                        const ToneMapping& tone);

// Errors: io Error naming the file, for a file that is missing, of another format, damaged or too short.
Image8 read_png(const std::filesystem::path& path);
Image8 read_ppm(const std::filesystem::path& path);
Picture read_pfm(const std::filesystem::path& path);    // colour or grey
Image8 read_image8(const std::filesystem::path& path);  // by extension: .png or .ppm

}  // namespace firn
