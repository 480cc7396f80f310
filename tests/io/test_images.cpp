// SPDX-License-Identifier: MIT
// Pictures: round trips through the file formats, and the laws of the tone curve.
#include <cmath>
#include <cstring>
#include <limits>

#include "firn/error.h"
#include "src/core/rng.h"
#include "src/io/exr.h"
#include "src/io/file.h"
#include "src/io/images.h"
#include "tests/catch.h"
#include "tests/io/scratch.h"

using namespace firn;

namespace {

Picture random_film(int width, int height) {
  Picture film;
  film.resize(width, height);
  for (std::size_t i = 0; i < film.rgb.size(); ++i) film.rgb[i] = 3.f * uniform_float(hash_keys(7, i)) - 0.2f;
  return film;
}

}  // namespace

TEST_CASE("A PNG and a PPM read back to the developed pixels") {
  Scratch scratch;
  const Picture film = random_film(37, 11);
  const Image8 image = to_image8(film, {0.5});
  for (const std::string format : {"png", "ppm"}) {
    write_file(scratch / ("x." + format), encode_picture(film, format, {0.5})[0].bytes);
    const Image8 back = read_image8(scratch / ("x." + format));
    CHECK(back.width == 37);
    CHECK(back.height == 11);
    CHECK(back.rgb == image.rgb);
  }
}

TEST_CASE("A PFM reads back to the linear film bit for bit, with row 0 at the top") {
  Scratch scratch;
  const Picture film = random_film(5, 9);
  write_file(scratch / "x.pfm", encode_picture(film, "pfm", {3})[0].bytes);
  CHECK(read_pfm(scratch / "x.pfm").rgb == film.rgb);
  const std::string bytes = read_file(scratch / "x.pfm");
  float last_row_first;
  std::memcpy(&last_row_first, bytes.data() + bytes.size() - film.rgb.size() * 4, 4);
  CHECK(last_row_first == film.pixel(0, 8)[0]);
}

TEST_CASE("A picture file that is cut short or damaged is an io Error") {
  Scratch scratch;
  const Picture film = random_film(16, 16);
  for (const std::string format : {"png", "ppm", "pfm"}) {
    const auto path = scratch / ("x." + format);
    const std::string bytes = encode_picture(film, format, {})[0].bytes;
    write_file(path, bytes.substr(0, bytes.size() - 20));
    INFO(format);
    if (format == "pfm") CHECK_THROWS_AS(read_pfm(path), Error);
    if (format != "pfm") CHECK_THROWS_AS(read_image8(path), Error);
  }
}

TEST_CASE("8-bit sRGB is exact: every level survives the way to linear and back") {
  for (int level = 0; level < 256; ++level) {
    CHECK(srgb8(srgb8_to_linear(static_cast<std::uint8_t>(level))) == level);
  }
  CHECK(srgb8(-1.f) == 0);
  CHECK(srgb8(7.f) == 255);
  CHECK(srgb8(0.18f) == 118);
}

TEST_CASE("The soft tone curve is the identity below its shoulder, then rises smoothly and stays below one") {
  for (float x = 0; x <= kShoulder; x += 0.01f) CHECK(tone_curve(ToneMap::soft, x) == x);
  float before = kShoulder, slope_before = 1;
  for (float x = kShoulder + 0.01f; x < 8; x += 0.01f) {
    const float y = tone_curve(ToneMap::soft, x), slope = (y - before) / 0.01f;
    REQUIRE(slope > 0);
    REQUIRE(slope < slope_before + 1e-3f);
    REQUIRE(slope > slope_before - 0.05f);
    before = y;
    slope_before = slope;
  }
  CHECK(tone_curve(ToneMap::soft, 1e30f) <= 1);
  CHECK(tone_curve(ToneMap::soft, -1) == 0);
  CHECK(tone_curve(ToneMap::soft, std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("The plain tone map is clipped sRGB, and the filmic one is an S that keeps middle grey") {
  for (float x = 0; x <= 1; x += 0.01f) CHECK(tone_curve(ToneMap::srgb, x) == x);
  CHECK(srgb8(tone_curve(ToneMap::srgb, 3)) == 255);
  CHECK(tone_curve(ToneMap::filmic, 0.18f) == Approx(0.18f).epsilon(1e-5));
  CHECK(tone_curve(ToneMap::filmic, 1e-4f) == Approx(0.5e-4f).epsilon(1e-2));
  CHECK(tone_curve(ToneMap::filmic, 1) == Approx(0.751f).epsilon(1e-3));
  float before = 0;
  for (float x = 0.01f; x < 50; x *= 1.1f) {
    const float y = tone_curve(ToneMap::filmic, x);
    REQUIRE(y > before);
    REQUIRE(y < 1);
    before = y;
  }
  CHECK(tone_curve(ToneMap::filmic, std::numeric_limits<float>::infinity()) <= 1);
  CHECK(tone_curve(ToneMap::filmic, std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE(
    "Layers go into PFM files of their own, grey ones with one number a pixel, endless depth included") {
  Scratch scratch;
  Picture film = random_film(5, 4);
  film.layers.push_back({Layer::normal, random_film(5, 4).rgb});
  film.layers.push_back({Layer::depth, std::vector<float>(20, 2.5f)});
  film.layers[1].values[7] = std::numeric_limits<float>::infinity();
  const auto files = encode_picture(film, "pfm", {});
  REQUIRE(files.size() == 3);
  CHECK(files[0].extension == "pfm");
  CHECK(files[1].extension == "normal.pfm");
  CHECK(files[2].extension == "depth.pfm");
  for (const PictureFile& file : files) write_file(scratch / file.extension, file.bytes);
  CHECK(read_pfm(scratch / "normal.pfm").rgb == film.layers[0].values);
  const Picture depth = read_pfm(scratch / "depth.pfm");
  CHECK(depth.pixel(0, 0)[0] == 2.5f);
  CHECK(depth.pixel(2, 1)[2] == std::numeric_limits<float>::infinity());
  CHECK(encode_picture(film, "png", {}).size() == 1);
  CHECK_THROWS_AS(encode_picture(film, "bmp", {}), Error);
}

TEST_CASE(
    "An OpenEXR file starts with its magic number and names every channel; without OpenEXR it is an Error") {
  Picture film = random_film(40, 30);
  film.layers.push_back({Layer::albedo, random_film(40, 30).rgb});
  film.layers.push_back({Layer::depth, std::vector<float>(1200, 2.5f)});
  if (!has_exr()) {
    CHECK_THROWS_AS(encode_picture(film, "exr", {}), Error);
    return;
  }
  const std::string bytes = encode_picture(film, "exr", {})[0].bytes;
  CHECK(bytes.compare(0, 4, "\x76\x2f\x31\x01") == 0);
  for (const char* channel : {"R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "depth.Z"}) {
    INFO(channel);
    CHECK(bytes.substr(0, 1000).find(std::string(channel) + '\0') != std::string::npos);
  }
  CHECK(bytes == encode_picture(film, "exr", {})[0].bytes);
}

TEST_CASE("One stop of exposure doubles the radiance") {
  Picture film;
  film.resize(1, 1);
  film.rgb = {0.05f, 0.1f, 0.2f};
  Picture twice = film;
  for (float& value : twice.rgb) value *= 2;
  CHECK(to_image8(film, {1}).rgb == to_image8(twice, {}).rgb);
}

TEST_CASE("A header that promises more pixels than an integer counts is refused") {
  Scratch scratch;
  const std::string pixels(12, '\0');
  for (const std::string size : {"2147483647 2147483647", "1 2147483647", "2147483647 1",
                                 "1073741824 1431655765", "-1 -1", "1 0", "1 4611686018427387905"}) {
    write_file(scratch / "x.pfm", "PF\n" + size + "\n-1.0\n" + pixels);
    INFO(size);
    CHECK_THROWS_AS(read_pfm(scratch / "x.pfm"), Error);
    write_file(scratch / "x.ppm", "P6\n" + size + "\n255\n" + pixels);
    CHECK_THROWS_AS(read_ppm(scratch / "x.ppm"), Error);
  }
  write_file(scratch / "x.pfm", "PF\n1 1\n-1.0\n" + pixels);
  CHECK(read_pfm(scratch / "x.pfm").width == 1);
  for (const std::string cut : {"PF", "PF\n1 1\n-1.0", "PF\n1 1\n-1.0\n"}) {
    write_file(scratch / "x.pfm", cut);
    CHECK_THROWS_AS(read_pfm(scratch / "x.pfm"), Error);
  }
}
