// SPDX-License-Identifier: MIT
// Where light is gathered: samples of paths and splats -> sums per pixel -> a Picture. Samples are added by
// the one thread that has the pixel's tile. Splats come from any thread to any pixel: they are kept in fixed
// point, where the order of adding does not matter, so the picture has the same bits for any number of
// threads.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "firn/picture.h"
#include "src/core/vector.h"
#include "src/render/film/denoise.h"
#include "src/render/film/filter.h"

namespace firn {

struct FilmSample {              // of one path, linear RGB
  Vec3f beauty = Vec3f::Zero();  // all its light, sparkle included
  Vec3f sparkle = Vec3f::Zero();
  Vec3f subsurface = Vec3f::Zero();  // that was scattered inside of something
  Vec3f albedo = Vec3f::Ones();      // of what it met first; 1 if that glows or is nothing
  Vec3f normal = Vec3f::Zero();      // unit, there; world axes
  Vec3f lit_normal = Vec3f::Zero();  // that by which light falls on it: with the grain of snow
  float depth = INFINITY;            // m to it; infinite: it met nothing
};

// What a film keeps beside the light; the rest of FilmSample is dropped.
struct FilmContent {
  bool guides = false;   // albedo, normal, depth
  bool denoise = false;  // all that noisy() tells, guides and sparkle included
  bool sparkle = false;
  bool subsurface = false;
  bool splats = false;
};

class Film {
 public:
  // Empty, of this size.
  void begin(int width, int height, const PixelFilter& filter, const FilmContent& content);

  int width() const { return width_; }
  int height() const { return height_; }

  void add(int x, int y, const FilmSample& sample);

  // Light that a light path brought to the film point (x, y), in pixels, for any point within the filter's
  // reach of the film. `radiance`: its contribution to the film as a whole, divided by the density that the
  // path was made with: the film assumes one light path for every sample added and weighs by the pixel
  // filter. Not finite or negative light is dropped. sample: which of its pixel's the light path is.
  void splat(float x, float y, const Vec3f& radiance, std::uint32_t sample);

  std::uint32_t samples(int x, int y) const { return count_[index(x, y)]; }
  std::uint64_t samples() const;
  float luminance(int x, int y) const;  // of the mean
  // Of the mean's luminance, pixel by pixel; infinite for fewer than two samples. That of samples by their
  // squares, that of splats by the spread of kSplatBatches.
  std::vector<float> variances() const;

  // The mean of all that was added, and the layers asked for; those that the film did not keep are 0.
  Picture picture(const std::vector<Layer>& layers) const;
  // The picture without its sparkle, and what there is to know of it; with FilmContent::denoise.
  NoisyPicture noisy() const;

 private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }
  std::vector<float> beauty() const;
  std::vector<float> layer(Layer layer) const;
  std::vector<float> means(const std::vector<float>& sums) const;  // of the samples of each pixel
  std::vector<float> variances(const std::vector<float>& means, const std::vector<float>& squares) const;
  void add_splat_variances(std::vector<float>& variances) const;
  double splat_scale(std::uint64_t paths) const;  // of splats of so many light paths

  int width_ = 0, height_ = 0;
  PixelFilter filter_;
  std::vector<double> beauty_, square_;  // 3 and 1 a pixel: light, and the square of its luminance
  std::vector<std::uint32_t> count_;
  std::vector<float> albedo_, normal_, depth_, sparkle_, subsurface_;  // sums; empty if not kept
  std::vector<float> lit_normal_;                                      // sums, for the denoiser
  std::vector<float> matte_square_, albedo_square_;                    // of luminance; matte: without sparkle
  std::vector<std::uint32_t> met_;                                     // samples that met something
  // By sample number, so that each is an estimate of the same light: 3 a pixel, in units of 2^-32 after
  // division by the number of pixels.
  static constexpr std::uint32_t kSplatBatches = 4;
  std::array<std::vector<std::uint64_t>, kSplatBatches> splats_;
};

}  // namespace firn
