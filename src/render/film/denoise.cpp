// SPDX-License-Identifier: MIT
#include "src/render/film/denoise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "src/core/parallel.h"

namespace firn {
namespace {

constexpr int kReach = 5;  // pixels to each side that a pixel is compared with
constexpr int kPatch = 2;  // pixels to each side of two that are compared
constexpr int kMargin = kReach + kPatch;
constexpr float kStrength = 0.7f;  // of the light's noise, in standard deviations
constexpr float kDarkest = 0.02f;  // albedo that light is divided by at least
constexpr float kFar = 1e6f;       // m, of what is not there
// What differences of the guides weigh against differences of the light.
constexpr float kNormals = 4, kAlbedos = 100, kDepths = 1000;
constexpr float kRidge = 0.001f;  // keeps the fit level where all normals are alike

// One number a pixel, with a margin that repeats the edge, so that no loop asks where the picture ends.
class Plane {
 public:
  Plane(int width, int height)
      : width_(width),
        height_(height),
        values_(static_cast<std::size_t>(width + 2 * kMargin) * (height + 2 * kMargin)) {}

  float* row(int y) {
    return values_.data() + static_cast<std::size_t>(y + kMargin) * (width_ + 2 * kMargin) + kMargin;
  }
  const float* row(int y) const { return const_cast<Plane*>(this)->row(y); }

  template <class Value>  // value(pixel), row by row
  Plane& fill(Value&& value) {
    for (int y = -kMargin; y < height_ + kMargin; ++y) {
      const std::size_t from = static_cast<std::size_t>(std::clamp(y, 0, height_ - 1)) * width_;
      for (int x = -kMargin; x < width_ + kMargin; ++x)
        row(y)[x] = value(from + std::clamp(x, 0, width_ - 1));
    }
    return *this;
  }

 private:
  int width_, height_;
  std::vector<float> values_;
};

using Plane3 = std::array<Plane, 3>;

float luminance(const Plane3& p, int x, int y) {
  return 0.2126f * p[0].row(y)[x] + 0.7152f * p[1].row(y)[x] + 0.0722f * p[2].row(y)[x];
}

struct Guides {
  Plane3 normal, albedo;
  Plane depth;
};

// What is compared, with its variance, which is noise itself and so the mean of 3 x 3 pixels.
struct Signal {
  Plane value, variance;
};

class Comparison {
 public:
  Comparison(int width, int height, const Guides& guides, const Signal& signal, float albedos)
      : width_(width), height_(height), guides_(guides), signal_(signal), albedos_(albedos) {}

  // visit(dx, dy, weights) for the offsets that pixels of row y are compared over; the weights are by x, 0
  // where x + dx is not in the picture.
  template <class Visit>
  void each(int y, Visit&& visit) const {
    std::vector<float> weights(width_), patches(width_ + 2 * kPatch);
    for (int dy = std::max(-kReach, -y); dy <= std::min(kReach, height_ - 1 - y); ++dy) {
      for (int dx = -kReach; dx <= kReach; ++dx) {
        std::fill(weights.begin(), weights.end(), 0.f);
        if (dx == 0 && dy == 0) {
          std::fill(weights.begin(), weights.end(), 1.f);
        } else {
          sum_columns(y, dx, dy, patches);
          weigh(y, dx, dy, patches.data(), weights.data());
        }
        visit(dx, dy, weights.data());
      }
    }
  }

 private:
  // Squared differences less what noise makes of them, in units of the noise; summed down the patch.
  void sum_columns(int y, int dx, int dy, std::vector<float>& sums) const {
    std::fill(sums.begin(), sums.end(), 0.f);
    for (int j = y - kPatch; j <= y + kPatch; ++j) {
      const float *a = signal_.value.row(j) - kPatch, *b = signal_.value.row(j + dy) + dx - kPatch;
      const float *va = signal_.variance.row(j) - kPatch, *vb = signal_.variance.row(j + dy) + dx - kPatch;
      for (int x = 0; x < width_ + 2 * kPatch; ++x) {
        const float d = a[x] - b[x];
        sums[x] +=
            (d * d - va[x] - std::min(va[x], vb[x])) / (1e-10f + kStrength * kStrength * (va[x] + vb[x]));
      }
    }
  }

  void weigh(int y, int dx, int dy, const float* patches, float* weights) const {
    constexpr float kArea = (2 * kPatch + 1) * (2 * kPatch + 1);
    const float *z = guides_.depth.row(y), *w = guides_.depth.row(y + dy) + dx;
    for (int x = std::max(0, -dx); x < std::min(width_, width_ - dx); ++x) {
      float sum = 0;
      for (int i = 0; i <= 2 * kPatch; ++i) sum += patches[x + i];
      const float s = (z[x] - w[x]) / (z[x] + w[x]);
      float unlike = std::max(0.f, sum / kArea) + kDepths * s * s;
      for (int c = 0; c < 3; ++c) {
        const float n = guides_.normal[c].row(y)[x] - guides_.normal[c].row(y + dy)[x + dx];
        const float a = guides_.albedo[c].row(y)[x] - guides_.albedo[c].row(y + dy)[x + dx];
        unlike += kNormals * n * n + albedos_ * a * a;
      }
      const float alike = std::max(0.f, 1 - 0.25f * unlike);  // about exp(-unlike)
      weights[x] = alike * alike * alike * alike;
    }
  }

  int width_, height_;
  const Guides& guides_;
  const Signal& signal_;
  float albedos_;
};

// Per pixel the normal equations of light = c0 + c1 (n - n_pixel).x + ...: the lower half of the 4 x 4 matrix
// row by row, each row followed by its three right sides, red, green and blue.
constexpr int kTerms = 10 + 4 * 3;

void add_terms(const Guides& guides, const Plane3& light, int y, int dx, int dy, int width,
               const float* weights, std::vector<float>& sums) {
  const float *normal[3], *there[3], *color[3];
  for (int c = 0; c < 3; ++c) {
    normal[c] = guides.normal[c].row(y);
    there[c] = guides.normal[c].row(y + dy) + dx;
    color[c] = light[c].row(y + dy) + dx;
  }
  for (int x = 0; x < width; ++x) {
    if (weights[x] == 0) continue;
    const float f[4] = {1, there[0][x] - normal[0][x], there[1][x] - normal[1][x],
                        there[2][x] - normal[2][x]};
    float* sum = &sums[static_cast<std::size_t>(x) * kTerms];
    for (int a = 0; a < 4; ++a) {
      const float wf = weights[x] * f[a];
      for (int b = 0; b <= a; ++b) *sum++ += wf * f[b];
      for (int c = 0; c < 3; ++c) *sum++ += wf * color[c][x];
    }
  }
}

// c0 for each colour: eliminates the other unknowns, the last one first.
std::array<float, 3> solve(const float* sums) {
  float m[4][7];
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b <= a; ++b) m[a][b] = m[b][a] = *sums++;
    for (int c = 0; c < 3; ++c) m[a][4 + c] = *sums++;
  }
  for (int a = 1; a < 4; ++a) m[a][a] += kRidge * m[0][0];
  for (int k = 3; k > 0; --k) {
    for (int i = 0; i < k; ++i) {
      const float ratio = m[i][k] / m[k][k];
      for (int j = 0; j < 7; ++j) m[i][j] -= ratio * m[k][j];
    }
  }
  return {m[0][4] / m[0][0], m[0][5] / m[0][0], m[0][6] / m[0][0]};
}

class Denoiser {
 public:
  explicit Denoiser(const NoisyPicture& noisy)
      : width_(noisy.width), height_(noisy.height), guides_{planes(), planes(), plane()}, light_(planes()) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto albedo = [&](std::size_t i) { return std::max(noisy.albedo[3 * i + c], kDarkest); };
      guides_.normal[c].fill([&](std::size_t i) { return noisy.normal[3 * i + c]; });
      guides_.albedo[c].fill(albedo);
      light_[c].fill([&](std::size_t i) { return noisy.rgb[3 * i + c] / albedo(i); });
    }
    guides_.depth.fill([&](std::size_t i) { return std::isfinite(noisy.depth[i]) ? noisy.depth[i] : kFar; });
  }

  std::vector<float> run(const NoisyPicture& noisy) const {
    const Signal light = signal(light_, noisy.variance, true);
    const Signal albedo = signal(guides_.albedo, noisy.albedo_variance, false);
    const Comparison by_light(width_, height_, guides_, light, kAlbedos);
    const Comparison by_albedo(width_, height_, guides_, albedo, 0);
    std::vector<float> rgb(noisy.rgb.size());
    parallel_for(static_cast<std::size_t>(height_), 1, [&](std::size_t row) {
      float* out = &rgb[3 * row * width_];
      fit(by_light, static_cast<int>(row), out);
      multiply_albedo(by_albedo, static_cast<int>(row), out);
    });
    return rgb;
  }

 private:
  Plane plane() const { return {width_, height_}; }
  Plane3 planes() const { return {plane(), plane(), plane()}; }

  // variance: per pixel, of the luminance; `by_albedo`: of the light before it was divided by the albedo.
  Signal signal(const Plane3& planes, const std::vector<float>& variance, bool by_albedo) const {
    Signal result{plane(), plane()};
    Plane raw = plane();
    const auto at = [this](std::size_t i) {
      return std::pair(static_cast<int>(i) % width_, static_cast<int>(i) / width_);
    };
    result.value.fill([&](std::size_t i) { return luminance(planes, at(i).first, at(i).second); });
    raw.fill([&](std::size_t i) {
      const float albedo = by_albedo ? luminance(guides_.albedo, at(i).first, at(i).second) : 1;
      return variance[i] / (albedo * albedo);
    });
    result.variance.fill([&](std::size_t i) {
      const auto [x, y] = at(i);
      float sum = 0;
      for (int j = -1; j <= 1; ++j) {
        for (int k = -1; k <= 1; ++k) sum += raw.row(y + j)[x + k];
      }
      return sum / 9;
    });
    return result;
  }

  void fit(const Comparison& comparison, int y, float* rgb) const {
    std::vector<float> sums(static_cast<std::size_t>(width_) * kTerms);
    comparison.each(y, [&](int dx, int dy, const float* weights) {
      add_terms(guides_, light_, y, dx, dy, width_, weights, sums);
    });
    for (int x = 0; x < width_; ++x) {
      const auto light = solve(&sums[static_cast<std::size_t>(x) * kTerms]);
      for (int c = 0; c < 3; ++c) rgb[3 * x + c] = std::max(light[c], 0.f);
    }
  }

  void multiply_albedo(const Comparison& comparison, int y, float* rgb) const {
    std::vector<float> sums(static_cast<std::size_t>(width_) * 4);
    comparison.each(y, [&](int dx, int dy, const float* weights) {
      for (int x = 0; x < width_; ++x) {
        if (weights[x] == 0) continue;
        for (int c = 0; c < 3; ++c) sums[4 * x + c] += weights[x] * guides_.albedo[c].row(y + dy)[x + dx];
        sums[4 * x + 3] += weights[x];
      }
    });
    for (int x = 0; x < width_; ++x) {
      for (int c = 0; c < 3; ++c) rgb[3 * x + c] *= sums[4 * x + c] / sums[4 * x + 3];
    }
  }

  int width_, height_;
  Guides guides_;
  Plane3 light_;
};

}  // namespace

std::vector<float> denoise(const NoisyPicture& noisy) { return Denoiser(noisy).run(noisy); }

}  // namespace firn
