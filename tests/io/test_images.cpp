// SPDX-License-Identifier: MIT
// Pictures: round trips through the file formats, and the laws of the tone curve.
#include <cmath>
#include <cstring>
#include <limits>

#include "src/core/error.h"
#include "src/core/rng.h"
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
  const Image8 image = develop(film, 0.5);
  for (const std::string format : {"png", "ppm"}) {
    write_file(scratch / ("x." + format), encode_film(film, format, 0.5));
    const Image8 back = read_image8(scratch / ("x." + format));
    CHECK(back.width == 37);
    CHECK(back.height == 11);
    CHECK(back.rgb == image.rgb);
  }
}

TEST_CASE("A PFM reads back to the linear film bit for bit, with row 0 at the top") {
  Scratch scratch;
  const Picture film = random_film(5, 9);
  write_file(scratch / "x.pfm", encode_film(film, "pfm", 3));
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
    const std::string bytes = encode_film(film, format, 0);
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

TEST_CASE("The tone curve is the identity below its shoulder, then rises smoothly and stays below one") {
  for (float x = 0; x <= kShoulder; x += 0.01f) CHECK(tone_curve(x) == x);
  float before = kShoulder, slope_before = 1;
  for (float x = kShoulder + 0.01f; x < 8; x += 0.01f) {
    const float y = tone_curve(x), slope = (y - before) / 0.01f;
    REQUIRE(slope > 0);
    REQUIRE(slope < slope_before + 1e-3f);
    REQUIRE(slope > slope_before - 0.05f);
    before = y;
    slope_before = slope;
  }
  CHECK(tone_curve(1e30f) <= 1);
  CHECK(tone_curve(-1) == 0);
  CHECK(tone_curve(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("One stop of exposure doubles the radiance") {
  Picture film;
  film.resize(1, 1);
  film.rgb = {0.05f, 0.1f, 0.2f};
  Picture twice = film;
  for (float& value : twice.rgb) value *= 2;
  CHECK(develop(film, 1).rgb == develop(twice, 0).rgb);
}
