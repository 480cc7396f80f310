// SPDX-License-Identifier: MIT
// PNG goes through libpng's simplified interface: one call each way, errors as a message instead of longjmp.
#include "src/io/images.h"

#include <png.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <sstream>

#include "firn/error.h"
#include "src/io/exr.h"
#include "src/io/file.h"

namespace firn {
namespace {

static_assert(std::endian::native == std::endian::little,
              "PFM and particle files are written as memory holds them");

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw Error(ErrorCode::io, path.string(), what);
}

png_image png_header(const Image8& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGB;
  return header;
}

// The header of PPM and PFM: magic, width, height and one number, then a single white space and `bytes` of
// pixels.
struct Netpbm {
  int width = 0;
  int height = 0;
  double number = 0;
  const char* pixels = nullptr;
};

Netpbm parse_netpbm(const std::filesystem::path& path, const std::string& file, const char* magic,
                    std::size_t pixel) {
  std::istringstream in(file.substr(0, 64));
  std::string word;
  Netpbm header;
  if (!(in >> word >> header.width >> header.height >> header.number) || word != magic) {
    fail(path, std::string("not a ") + magic + " image");
  }
  const std::size_t start = in.eof() ? file.size() : static_cast<std::size_t>(in.tellg()) + 1;
  const std::size_t bytes = file.size() - std::min(start, file.size());
  // By division, since the product of what a header promises may be more than an integer holds.
  const bool sized =
      header.width > 0 && header.height > 0 && bytes % pixel == 0 &&
      bytes / pixel % static_cast<std::size_t>(header.width) == 0 &&
      bytes / pixel / static_cast<std::size_t>(header.width) == static_cast<std::size_t>(header.height);
  if (!sized) fail(path, "damaged image: its size does not fit its header");
  header.pixels = file.data() + start;
  return header;
}

}  // namespace

std::string encode_png(const Image8& image) {
  png_image header = png_header(image);
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr)) {
    throw Error(ErrorCode::failed, "png", header.message);
  }
  bytes.resize(size);
  return bytes;
}

std::string encode_ppm(const Image8& image) {
  std::string bytes = "P6\n" + std::to_string(image.width) + " " + std::to_string(image.height) + "\n255\n";
  return bytes.append(reinterpret_cast<const char*>(image.rgb.data()), image.rgb.size());
}

std::string encode_pfm(int width, int height, int channels, const std::vector<float>& values) {
  std::string bytes = channels == 3 ? "PF\n" : "Pf\n";
  bytes += std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
  const std::size_t row = static_cast<std::size_t>(channels) * width;
  for (int y = height; y-- > 0;) {
    bytes.append(reinterpret_cast<const char*>(&values[row * y]), row * sizeof(float));
  }
  return bytes;
}

std::vector<PictureFile> encode_picture(const Picture& picture, const std::string& format,
                                        const ToneMapping& tone) {
  if (format == "exr") return {{format, encode_exr(picture)}};
  if (format == "png") return {{format, encode_png(to_image8(picture, tone))}};
  if (format == "ppm") return {{format, encode_ppm(to_image8(picture, tone))}};
  if (format != "pfm") {
    throw Error(ErrorCode::usage, "output.formats", "'" + format + "' is not one of png, ppm, pfm, exr");
  }
  std::vector<PictureFile> files = {{format, encode_pfm(picture.width, picture.height, 3, picture.rgb)}};
  for (const LayerImage& l : picture.layers) {
    files.push_back({std::string(layer_name(l.layer)) + "." + format,
                     encode_pfm(picture.width, picture.height, channels_of(l.layer), l.values)});
  }
  return files;
}

Image8 read_png(const std::filesystem::path& path) {
  const std::string file = read_file(path);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&header, file.data(), file.size())) fail(path, header.message);
  // A byte of the file becomes 1032 bytes of rows at most (deflate), and a byte of rows 8 pixels.
  if (std::size_t{header.width} * header.height > std::size_t{8 * 1032} * file.size()) {
    png_image_free(&header);
    fail(path, "damaged image: its size does not fit its header");
  }
  header.format = PNG_FORMAT_RGB;
  Image8 image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
  image.rgb.resize(PNG_IMAGE_SIZE(header));
  if (!png_image_finish_read(&header, nullptr, image.rgb.data(), 0, nullptr)) fail(path, header.message);
  return image;
}

Image8 read_ppm(const std::filesystem::path& path) {
  const std::string file = read_file(path);
  const Netpbm header = parse_netpbm(path, file, "P6", 3);
  if (header.number != 255) fail(path, "only 8-bit PPM images are read");
  Image8 image{header.width, header.height, {}};
  image.rgb.assign(header.pixels, file.data() + file.size());
  return image;
}

Picture read_pfm(const std::filesystem::path& path) {
  const std::string file = read_file(path);
  const bool grey = file.compare(0, 2, "Pf") == 0;
  const std::size_t channels = grey ? 1 : 3;
  const Netpbm header = parse_netpbm(path, file, grey ? "Pf" : "PF", channels * sizeof(float));
  if (header.number >= 0) fail(path, "only little-endian PFM images are read");
  Picture picture;
  picture.resize(header.width, header.height);
  std::vector<float> row(channels * header.width);
  for (int y = 0; y < header.height; ++y) {
    const std::size_t bytes = row.size() * sizeof(float);
    std::memcpy(row.data(), header.pixels + bytes * (header.height - 1 - y), bytes);
    for (int i = 0; i < 3 * header.width; ++i) picture.pixel(0, y)[i] = row[grey ? i / 3 : i];
  }
  return picture;
}

Image8 read_image8(const std::filesystem::path& path) {
  return path.extension() == ".ppm" ? read_ppm(path) : read_png(path);
}

}  // namespace firn
