// SPDX-License-Identifier: MIT
#include "src/render/film/film.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

namespace firn {
namespace {

constexpr double kSplatUnit = 0x1p-32;
constexpr double kSplatLimit = 0x1p30;  // of one splat, after division by the number of pixels

void add_to(std::vector<float>& sums, std::size_t pixel, const Vec3f& value) {
  if (sums.empty()) return;
  for (int c = 0; c < 3; ++c) sums[3 * pixel + c] += value[c];
}

}  // namespace

void Film::begin(int width, int height, const PixelFilter& filter, const FilmContent& content) {
  width_ = width;
  height_ = height;
  filter_ = filter;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  beauty_.assign(3 * pixels, 0);
  square_.assign(pixels, 0);
  count_.assign(pixels, 0);
  const bool guides = content.guides || content.denoise;
  for (auto* guide : {&albedo_, &normal_}) guide->assign(guides ? 3 * pixels : 0, 0);
  depth_.assign(guides ? pixels : 0, 0);
  met_.assign(guides ? pixels : 0, 0);
  for (auto* square : {&matte_square_, &albedo_square_}) square->assign(content.denoise ? pixels : 0, 0);
  lit_normal_.assign(content.denoise ? 3 * pixels : 0, 0);
  sparkle_.assign(content.sparkle || content.denoise ? 3 * pixels : 0, 0);
  subsurface_.assign(content.subsurface ? 3 * pixels : 0, 0);
  for (auto& batch : splats_) batch.assign(content.splats ? 3 * pixels : 0, 0);
}

void Film::add(int x, int y, const FilmSample& sample) {
  const std::size_t pixel = index(x, y);
  for (int c = 0; c < 3; ++c) beauty_[3 * pixel + c] += sample.beauty[c];
  const double bright = luminance_of(sample.beauty);
  square_[pixel] += bright * bright;
  ++count_[pixel];
  add_to(albedo_, pixel, sample.albedo);
  add_to(normal_, pixel, sample.normal);
  add_to(lit_normal_, pixel, sample.lit_normal);
  add_to(sparkle_, pixel, sample.sparkle);
  add_to(subsurface_, pixel, sample.subsurface);
  if (!matte_square_.empty()) {
    const float matte = luminance_of(Vec3f(sample.beauty - sample.sparkle));
    const float albedo = luminance_of(sample.albedo);
    matte_square_[pixel] += matte * matte;
    albedo_square_[pixel] += albedo * albedo;
  }
  if (!depth_.empty() && std::isfinite(sample.depth)) {
    depth_[pixel] += sample.depth;
    ++met_[pixel];
  }
}

void Film::splat(float x, float y, const Vec3f& radiance, std::uint32_t sample) {
  if (!radiance.allFinite() || radiance.minCoeff() < 0) return;
  std::vector<std::uint64_t>& batch = splats_[sample % kSplatBatches];
  const double r = filter_.radius(), scale = 1 / static_cast<double>(count_.size());
  const auto first = [r](float at) { return std::max(0, static_cast<int>(std::ceil(at - 0.5 - r))); };
  const auto last = [r](float at, int end) {
    return std::min(end - 1, static_cast<int>(std::floor(at - 0.5 + r)));
  };
  for (int j = first(y); j <= last(y, height_); ++j) {
    const double down = filter_.density(y - 0.5 - j);
    for (int i = first(x); i <= last(x, width_); ++i) {
      const double weight = scale * down * filter_.density(x - 0.5 - i);
      for (int c = 0; c < 3; ++c) {
        const double amount = std::min(weight * radiance[c], kSplatLimit) / kSplatUnit;
        std::atomic_ref(batch[3 * index(i, j) + c])
            .fetch_add(static_cast<std::uint64_t>(amount + 0.5), std::memory_order_relaxed);
      }
    }
  }
}

std::uint64_t Film::samples() const {
  return std::accumulate(count_.begin(), count_.end(), std::uint64_t{0});
}

float Film::luminance(int x, int y) const {
  const std::size_t pixel = index(x, y);
  const Vec3 sum(beauty_[3 * pixel], beauty_[3 * pixel + 1], beauty_[3 * pixel + 2]);
  return count_[pixel] ? static_cast<float>(luminance_of(sum) / count_[pixel]) : 0;
}

std::vector<float> Film::variances() const {
  std::vector<float> result(count_.size(), INFINITY);
  for (std::size_t pixel = 0; pixel < result.size(); ++pixel) {
    const double n = count_[pixel];
    if (n < 2) continue;
    const double mean =
        luminance_of(Vec3(beauty_[3 * pixel], beauty_[3 * pixel + 1], beauty_[3 * pixel + 2])) / n;
    result[pixel] = static_cast<float>(std::max(square_[pixel] / n - mean * mean, 0.0) / (n - 1));
  }
  add_splat_variances(result);
  return result;
}

// Batches are estimates of the same mean, of as good as equal weight.
void Film::add_splat_variances(std::vector<float>& variances) const {
  if (splats_[0].empty()) return;
  std::array<double, kSplatBatches> scales{};
  int batches = 0;
  for (std::uint32_t b = 0; b < kSplatBatches; ++b) {
    std::uint64_t paths = 0;
    for (const std::uint32_t n : count_) paths += (n + kSplatBatches - 1 - b) / kSplatBatches;
    if (paths > 0) scales[b] = splat_scale(paths), ++batches;
  }
  for (std::size_t pixel = 0; pixel < variances.size(); ++pixel) {
    double sum = 0, squares = 0;
    for (std::uint32_t b = 0; b < kSplatBatches; ++b) {
      const std::uint64_t* splats = &splats_[b][3 * pixel];
      const double bright =
          scales[b] * luminance_of(Vec3(static_cast<double>(splats[0]), static_cast<double>(splats[1]),
                                        static_cast<double>(splats[2])));
      sum += bright, squares += bright * bright;
    }
    if (batches < 2) variances[pixel] = INFINITY;
    if (batches >= 2)
      variances[pixel] += static_cast<float>(
          std::max(squares / batches - sum * sum / (batches * batches), 0.0) / (batches - 1));
  }
}

double Film::splat_scale(std::uint64_t paths) const {
  return kSplatUnit * static_cast<double>(count_.size()) /
         static_cast<double>(std::max<std::uint64_t>(paths, 1));
}

std::vector<float> Film::beauty() const {
  std::vector<float> rgb(beauty_.size());
  const bool splats = !splats_[0].empty();
  const double scale = splats ? splat_scale(samples()) : 0;
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const double mean = beauty_[i] / std::max(count_[i / 3], 1u);
    std::uint64_t all = 0;
    for (std::size_t b = 0; splats && b < kSplatBatches; ++b) all += splats_[b][i];
    rgb[i] = static_cast<float>(splats ? mean + scale * static_cast<double>(all) : mean);
  }
  return rgb;
}

std::vector<float> Film::means(const std::vector<float>& sums) const {
  const std::size_t channels = sums.size() / count_.size();
  std::vector<float> values(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i)
    values[i] = sums[i] / static_cast<float>(std::max(count_[i / channels], 1u));
  return values;
}

std::vector<float> Film::layer(Layer layer) const {
  std::vector<float> values(channels_of(layer) * count_.size());
  const auto mean_of = [&](const std::vector<float>& sums) {
    if (!sums.empty()) values = means(sums);
  };
  switch (layer) {
    case Layer::beauty:
      return beauty();
    case Layer::albedo:
      mean_of(albedo_);
      break;
    case Layer::normal:
      mean_of(normal_);
      break;
    case Layer::sparkle:
      mean_of(sparkle_);
      break;
    case Layer::subsurface:
      mean_of(subsurface_);
      break;
    case Layer::depth:
      for (std::size_t i = 0; i < met_.size(); ++i)
        values[i] = met_[i] ? depth_[i] / static_cast<float>(met_[i]) : INFINITY;
      break;
    case Layer::samples:
      std::transform(count_.begin(), count_.end(), values.begin(),
                     [](std::uint32_t n) { return static_cast<float>(n); });
      break;
    case Layer::variance:
      values = variances();
      break;
  }
  return values;
}

// The variance of the means of `sums` by the sums of their squares.
std::vector<float> Film::variances(const std::vector<float>& means, const std::vector<float>& squares) const {
  std::vector<float> result(squares.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const auto n = static_cast<float>(std::max(count_[i], 2u));
    const float mean = luminance_of(Vec3f(means[3 * i], means[3 * i + 1], means[3 * i + 2]));
    result[i] = std::max(squares[i] / n - mean * mean, 0.f) / (n - 1);
  }
  return result;
}

NoisyPicture Film::noisy() const {
  NoisyPicture noisy{
      width_, height_, {}, {}, layer(Layer::albedo), {}, means(lit_normal_), layer(Layer::depth)};
  const std::vector<float> sparkle = layer(Layer::sparkle);
  std::vector<float> matte(beauty_.size());
  noisy.rgb = beauty();
  for (std::size_t i = 0; i < matte.size(); ++i) {
    noisy.rgb[i] -= sparkle[i];
    matte[i] = static_cast<float>(beauty_[i] / std::max(count_[i / 3], 1u)) - sparkle[i];
  }
  noisy.variance = variances(matte, matte_square_);
  add_splat_variances(noisy.variance);
  noisy.albedo_variance = variances(noisy.albedo, albedo_square_);
  return noisy;
}

Picture Film::picture(const std::vector<Layer>& layers) const {
  Picture picture;
  picture.width = width_;
  picture.height = height_;
  picture.rgb = beauty();
  for (const Layer wanted : layers) {
    if (wanted != Layer::beauty) picture.layers.push_back({wanted, layer(wanted)});
  }
  return picture;
}

}  // namespace firn
