// SPDX-License-Identifier: MIT
#include "src/render/film/adaptive.h"

#include <algorithm>
#include <vector>

#include "src/core/parallel.h"

namespace firn {
namespace {

constexpr std::uint32_t kFirstRound = 16;
constexpr double kBlack = 0.01;  // of the picture's mean luminance

double mean_luminance(const Film& film) {
  double sum = 0;
  for (int y = 0; y < film.height(); ++y) {
    for (int x = 0; x < film.width(); ++x) sum += film.luminance(x, y);
  }
  return sum / (static_cast<double>(film.width()) * film.height());
}

bool finished(const Film& film, const std::vector<float>& variances, int x, int y, double noise,
              double black) {
  const auto variance_of = [&](int i, int j) {
    return static_cast<double>(variances[static_cast<std::size_t>(j) * film.width() + i]);
  };
  double variance = 0, luminance = 0, pixels = 0;  // of a single sample
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, film.height() - 1); ++j) {
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, film.width() - 1); ++i) {
      variance += variance_of(i, j) * film.samples(i, j);
      luminance += film.luminance(i, j);
      ++pixels;
    }
  }
  const double own = variance_of(x, y), around = variance / pixels / film.samples(x, y);
  const double allowed = noise * (luminance / pixels + black);
  return std::max(own, around) <= allowed * allowed;
}

}  // namespace

SampleRange next_round(std::uint32_t last, std::uint32_t samples, bool adaptive) {
  if (!adaptive) return {last, samples};
  const std::uint32_t count = std::max(last, kFirstRound);
  return {last, count < samples - last ? last + count : samples};
}

SampleRange share(const SampleRange& round, std::uint32_t part, std::uint32_t parts) {
  const std::uint64_t count = round.last - round.first;
  return {round.first + static_cast<std::uint32_t>(count * part / parts),
          round.first + static_cast<std::uint32_t>(count * (part + 1) / parts)};
}

void drop_finished(const Film& film, double noise, PixelSet& wanted) {
  const double black = kBlack * mean_luminance(film);
  const std::vector<float> variances = film.variances();
  parallel_for(static_cast<std::size_t>(film.height()), 8, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < film.width(); ++x) {
      if (wanted.has(x, y) && finished(film, variances, x, y, noise, black)) wanted.drop(x, y);
    }
  });
}

}  // namespace firn
