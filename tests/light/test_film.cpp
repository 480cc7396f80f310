// SPDX-License-Identifier: MIT
// The film: means, variances, layers, and splats that lose no light.
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "src/core/rng.h"
#include "src/render/film/film.h"
#include "tests/catch.h"

namespace firn::test::film {
namespace {

Film film_of(int width, int height, const FilmContent& content, FilterKind kind = FilterKind::tent) {
  Film film;
  film.begin(width, height, PixelFilter(kind), content);
  return film;
}

const std::vector<float>& values(const Picture& picture, Layer layer) {
  for (const LayerImage& image : picture.layers) {
    if (image.layer == layer) return image.values;
  }
  throw std::logic_error("layer not kept");
}

FilmSample bright(float value) {
  FilmSample sample;
  sample.beauty = Vec3f(value, 2 * value, 3 * value);
  return sample;
}

}  // namespace

TEST_CASE("a film is the mean of its samples, and knows the variance of that mean") {
  Film film = film_of(3, 2, {});
  double sum = 0, squares = 0;
  constexpr int kCount = 1000;
  for (int i = 0; i < kCount; ++i) {
    const float value = uniform_float(hash_keys(5, i));
    film.add(2, 1, bright(value));
    const double y = luminance_of(Vec3f(value, 2 * value, 3 * value));
    sum += y;
    squares += y * y;
  }
  const double mean = sum / kCount, variance = (squares - kCount * mean * mean) / (kCount - 1) / kCount;
  CHECK(film.samples(2, 1) == kCount);
  CHECK(film.samples() == kCount);
  CHECK(film.luminance(2, 1) == Approx(mean).epsilon(1e-5));
  CHECK(film.variances()[5] == Approx(variance).epsilon(1e-4));
  CHECK(std::isinf(film.variances()[0]));
  const Picture picture = film.picture({Layer::samples, Layer::variance});
  CHECK(picture.pixel(2, 1)[2] == Approx(3 * picture.pixel(2, 1)[0]));
  CHECK(picture.pixel(0, 0)[0] == 0);
  CHECK(values(picture, Layer::samples)[5] == kCount);
  CHECK(values(picture, Layer::variance)[5] == film.variances()[5]);
}

// Uniform numbers have the variance 1/12; of ten million pixels' worth of estimates from 16 samples each, the
// mean estimate must be that, without a factor n / (n - 1).
TEST_CASE("the estimate of the variance has no bias") {
  double sum = 0;
  constexpr int kPixels = 20000;
  Film film = film_of(kPixels, 1, {});
  for (int x = 0; x < kPixels; ++x) {
    for (int i = 0; i < 16; ++i) {
      FilmSample sample;
      sample.beauty = Vec3f::Constant(uniform_float(hash_keys(8, x, i)));
      film.add(x, 0, sample);
    }
  }
  for (const float variance : film.variances()) sum += variance;
  CHECK(sum / kPixels == Approx(1.0 / 12 / 16).epsilon(0.01));
}

TEST_CASE("layers are means of what was added; depth is of the samples that met something") {
  FilmContent content;
  content.guides = content.sparkle = content.subsurface = true;
  Film film = film_of(1, 1, content);
  FilmSample near = bright(1), sky;
  near.albedo = Vec3f(0.2f, 0.4f, 0.6f);
  near.normal = Vec3f(0, 1, 0);
  near.depth = 3;
  near.sparkle = Vec3f::Constant(0.5f);
  near.subsurface = Vec3f::Constant(0.25f);
  film.add(0, 0, near);
  film.add(0, 0, sky);
  const Picture picture = film.picture(
      {Layer::beauty, Layer::albedo, Layer::normal, Layer::depth, Layer::sparkle, Layer::subsurface});
  CHECK(picture.layers.size() == 5);  // the beauty is the picture itself
  CHECK(values(picture, Layer::albedo) == std::vector<float>{0.6f, 0.7f, 0.8f});
  CHECK(values(picture, Layer::normal) == std::vector<float>{0, 0.5f, 0});
  CHECK(values(picture, Layer::depth) == std::vector<float>{3});
  CHECK(values(picture, Layer::sparkle) == std::vector<float>{0.25f, 0.25f, 0.25f});
  CHECK(values(picture, Layer::subsurface) == std::vector<float>{0.125f, 0.125f, 0.125f});
}

// One light path for every sample of 8 x 8 pixels. Each brings 5 to a place of its own: the mean over the
// pixels is 5 / 64 times 64 places, wherever the filter puts it, as long as it lies well within the film.
TEST_CASE("splats lose no light in any filter") {
  for (const FilterKind kind :
       {FilterKind::box, FilterKind::tent, FilterKind::gaussian, FilterKind::blackman_harris}) {
    FilmContent content;
    content.splats = true;
    Film film = film_of(8, 8, content, kind);
    double sum = 0;
    constexpr int kPaths = 6400;
    for (int i = 0; i < kPaths; ++i) {
      film.add(i % 8, i / 8 % 8, FilmSample{});
      const float x = 2 + 4 * uniform_float(hash_keys(1, i)), y = 2 + 4 * uniform_float(hash_keys(2, i));
      film.splat(x, y, Vec3f::Constant(5), static_cast<std::uint32_t>(i / 64));
    }
    for (const float value : film.picture({}).rgb) sum += value;
    // A filter of steps (box) is exact; of a curve, its values at the pixels' centres sum to 1 on average.
    CHECK(sum / 3 == Approx(5 * 64 / 64.0 * 64 / 64).epsilon(0.01));
  }
}

// The same light, found by camera paths (placed by the filter) and by light paths (weighed by it): a bright
// square [3.2, 4.7]^2 on a film of 8 x 8, pixel by pixel within 4.5 standard deviations.
TEST_CASE("splats and samples are filtered alike") {
  FilmContent content;
  content.splats = true;
  for (const FilterKind kind : {FilterKind::box, FilterKind::tent, FilterKind::gaussian}) {
    Film seen = film_of(8, 8, {}, kind), met = film_of(8, 8, content, kind);
    const PixelFilter filter(kind);
    const auto in_square = [](double x) { return x > 3.2 && x < 4.7; };
    constexpr int kSamples = 4096;
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        for (int s = 0; s < kSamples; ++s) {
          const double fx = x + 0.5 + filter.sample(uniform_float(hash_keys(1, y * 8 + x, 2 * s)));
          const double fy = y + 0.5 + filter.sample(uniform_float(hash_keys(1, y * 8 + x, 2 * s + 1)));
          seen.add(x, y, in_square(fx) && in_square(fy) ? bright(1) : FilmSample{});
          met.add(x, y, FilmSample{});
          // A light path to an even point of the square, divided by its density, 1 / 1.5^2.
          const float lx = 3.2f + 1.5f * uniform_float(hash_keys(2, y * 8 + x, 2 * s));
          const float ly = 3.2f + 1.5f * uniform_float(hash_keys(2, y * 8 + x, 2 * s + 1));
          met.splat(lx, ly, Vec3f(1, 2, 3) * 2.25f, static_cast<std::uint32_t>(s));
        }
      }
    }
    const Picture a = seen.picture({}), b = met.picture({});
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        const float p = a.pixel(x, y)[0];
        const double error = std::sqrt(std::max(p * (1 - p), 1e-4f) / kSamples);
        INFO("pixel " << x << ", " << y);
        CHECK(std::fabs(p - b.pixel(x, y)[0]) < 5 * error);
      }
    }
  }
}

TEST_CASE("splats have the same bits in any order, and drop what is no light") {
  FilmContent content;
  content.splats = true;
  Film once = film_of(16, 16, content), shuffled = film_of(16, 16, content);
  for (Film* film : {&once, &shuffled}) {
    for (int i = 0; i < 256; ++i) film->add(i % 16, i / 16, FilmSample{});
  }
  const auto splat = [](Film& film, int i) {
    film.splat(16 * uniform_float(hash_keys(3, i)), 16 * uniform_float(hash_keys(4, i)),
               Vec3f::Constant(uniform_float(hash_keys(5, i))), static_cast<std::uint32_t>(i));
  };
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) splat(once, i);
  tbb::parallel_for(0, kCount, [&](int i) { splat(shuffled, kCount - 1 - i); });
  const Picture a = once.picture({}), b = shuffled.picture({});
  CHECK(std::memcmp(a.rgb.data(), b.rgb.data(), a.rgb.size() * sizeof(float)) == 0);
  once.splat(8, 8, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()), 0);
  once.splat(8, 8, Vec3f::Constant(-1), 0);
  CHECK(once.picture({}).rgb == a.rgb);
}

}  // namespace firn::test::film
