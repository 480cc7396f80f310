// SPDX-License-Identifier: MIT
#include "src/render/lights/sky.h"

#include <algorithm>
#include <cmath>

#include "src/core/parallel.h"
#include "src/core/portable_math.h"
#include "src/render/sampling/directions.h"

namespace firn {
namespace {

constexpr float kUniform = 0.1f;  // part of the samples
constexpr int kInCell = 4;        // points a side of a cell that its mean is taken from

float smooth(float x) {
  const float t = std::clamp(x, 0.f, 1.f);
  return t * t * (3 - 2 * t);
}

// The horizon's colour reaches up as in a clear sky (a steep start) and gives way to the ground's within 6
// degrees.
Vec3f gradient(const SkyLight& sky, float y) {
  if (y < 0) return sky.horizon + smooth(-10 * y) * (sky.ground - sky.horizon);
  const float down = 1 - y;
  return sky.zenith + down * down * down * (sky.horizon - sky.zenith);
}

// As a part of a full turn, from +Z towards +X, in [0, 1).
double azimuth(const Vec3f& d) {
  const double x = d.x(), z = d.z(), r = std::sqrt(x * x + z * z);
  if (!(r > 0)) return 0;
  const double turn = portable_acos(std::clamp(z / r, -1.0, 1.0)) / 6.28318530717958647692;
  return x < 0 && turn > 0 ? 1 - turn : turn;
}

Vec3f direction_of(float y, float turn) {
  const Disc disc = on_circle(std::sqrt(std::max(0.f, 1 - y * y)), turn);
  return {disc.y, y, disc.x};
}

// The first of the growing chances that is above u, and where in it u lies.
std::size_t choose(const float* until, std::size_t count, float& u) {
  const std::size_t index = std::upper_bound(until, until + count - 1, u) - until;
  const float before = index > 0 ? until[index - 1] : 0;
  u = std::clamp((u - before) / (until[index] - before), 0.f, 1.f);
  return index;
}

}  // namespace

Sky::Sky(const std::vector<Light>& lights) {
  for (const Light& light : lights) {
    if (const auto* constant = std::get_if<ConstantLight>(&light)) constant_ += constant->radiance;
    if (const auto* sky = std::get_if<SkyLight>(&light)) gradients_.push_back(*sky), rows_ = 256;
    if (const auto* day = std::get_if<DaySkyLight>(&light)) days_.emplace_back(*day);
    if (const auto* image = std::get_if<ImageLight>(&light)) {
      images_.push_back({*image, static_cast<float>(1 + image->rotation / 360)});
    }
  }
  if (!days_.empty()) columns_ = 256, rows_ = 256;
  for (const Image& image : images_) {
    columns_ = std::max(columns_, std::min(image.light.picture->width, 1024));
    rows_ = std::max(rows_, std::min(image.light.picture->height, 512));
  }
  tabulate();
}

Vec3f Sky::radiance(const Vec3f& d) const {
  Vec3f sum = constant_;
  for (const SkyLight& sky : gradients_) sum += gradient(sky, d.y());
  for (const DaySky& day : days_) sum += day.radiance(d);
  for (const Image& image : images_) {
    const double down = portable_acos(d.y()) / 3.14159265358979323846;
    sum += image.light.radiance.cwiseProduct(image.light.picture->at(image.turn - azimuth(d), down, true));
  }
  return sum;
}

// Rows run from y = 1 down, columns with the azimuth.
void Sky::tabulate() {
  const auto rows = static_cast<std::size_t>(rows_), columns = static_cast<std::size_t>(columns_);
  std::vector<float> mean(rows * columns);
  parallel_for(rows, 1, [&](std::size_t row) {
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) {
      float sum = 0;
      for (int k = 0; k < kInCell * kInCell; ++k) {
        const float v = (static_cast<float>(k / kInCell) + 0.5f) / kInCell,
                    u = (static_cast<float>(k % kInCell) + 0.5f) / kInCell;
        const float y = 1 - 2 * (static_cast<float>(row) + v) / static_cast<float>(rows_);
        const float turn = (static_cast<float>(i - row * columns) + u) / static_cast<float>(columns_);
        sum += radiance(direction_of(y, turn)).sum();
      }
      mean[i] = sum / (kInCell * kInCell);
    }
  });
  double total = 0;
  for (const float value : mean) total += value;
  if (!(total > 0)) return;
  const double cells = static_cast<double>(mean.size());
  strength_ = static_cast<float>(total / cells * 4 * kPi);
  until_row_.resize(rows), until_cell_.resize(mean.size()), density_.resize(mean.size());
  double until = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    double in_row = 0;
    const auto chance = [&](std::size_t i) { return (1 - kUniform) * mean[i] / total + kUniform / cells; };
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) in_row += chance(i);
    double in_cell = 0;
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) {
      until_cell_[i] = static_cast<float>((in_cell += chance(i)) / in_row);
      density_[i] = static_cast<float>(chance(i) * cells / (4 * kPi));
    }
    until_row_[row] = static_cast<float>(until += in_row);
  }
}

std::size_t Sky::cell_of(const Vec3f& d) const {
  const int row = std::clamp(static_cast<int>((1 - d.y()) * 0.5f * static_cast<float>(rows_)), 0, rows_ - 1);
  if (columns_ == 1) return row;
  const int column = std::min(static_cast<int>(azimuth(d) * columns_), columns_ - 1);
  return static_cast<std::size_t>(row) * columns_ + column;
}

Vec3f Sky::sample(Sample2 at) const {
  float v = at.u, u = at.v;
  const std::size_t row = choose(until_row_.data(), rows_, v);
  const std::size_t column = choose(&until_cell_[row * columns_], columns_, u);
  const float y = 1 - 2 * (static_cast<float>(row) + v) / static_cast<float>(rows_);
  return direction_of(y, (static_cast<float>(column) + u) / static_cast<float>(columns_)).normalized();
}

kernels::SkyTable Sky::table() const {
  if (!(strength_ > 0)) return {};
  return {until_row_.data(), until_cell_.data(), rows_, columns_};
}

float Sky::density(const Vec3f& d) const { return strength_ > 0 ? density_[cell_of(d)] : 0; }

}  // namespace firn
