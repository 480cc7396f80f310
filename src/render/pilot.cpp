// SPDX-License-Identifier: MIT
#include "src/render/pilot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "src/core/rng.h"

namespace firn {
namespace {

// A turn of `wander`, its flight included, beside a ray with its shading. Measured:
// docs/decisions/018-auto.md.
constexpr double kTurn = 0.4;
constexpr double kPixels = 64;  // of a small picture
// At a glance: two pictures of each integrator, of one path a pixel.
constexpr int kGlance = 2, kGlanceSamples = 1;
constexpr double kTooDear = 0.05;     // of the work of the large picture, for a single one: not worth it
constexpr double kClearlyBetter = 3;  // times the work, or the light: no need, or every need, to look longer
// A longer look: light that comes evenly is stratified among a pixel's paths, as in the large picture.
constexpr int kSamples = 4, kMost = 64;  // paths a pixel; pictures
constexpr double kBudget = 0.005;        // of the work of the large picture, for both integrators together
constexpr double kBetter = 0.9;          // times the work of the first that another must do with

ImageSettings small(const ImageSettings& image, Integrator integrator, int samples) {
  ImageSettings pilot = image;
  const double scale = std::min(1.0, std::sqrt(kPixels / (static_cast<double>(image.width) * image.height)));
  pilot.width = std::max(1, static_cast<int>(std::lround(scale * image.width)));
  pilot.height = std::max(1, static_cast<int>(std::lround(scale * image.height)));
  pilot.samples = std::min(image.samples, samples);
  pilot.integrator = integrator;
  return pilot;
}

// One integrator's small pictures.
class Pilot {
 public:
  Pilot(const RenderSetup& setup, Integrator integrator, int samples = kGlanceSamples)
      : seed_(hash_keys(setup.seed, static_cast<std::uint64_t>(integrator),
                        0x70696c6f74ull + static_cast<std::uint64_t>(samples))),
        image_(small(setup.image, integrator, samples)) {}

  void look(int pictures, const Shoot& shoot) {
    for (; pictures > 0; --pictures) {
      const Shot shot = shoot(image_, mix64(seed_ + static_cast<std::uint64_t>(count_++)));
      work_ += shot.work;
      sum_.resize(shot.picture.rgb.size());
      squares_.resize(shot.picture.rgb.size());
      for (std::size_t i = 0; i < sum_.size(); ++i) {
        const double value = shot.picture.rgb[i];
        sum_[i] += value;
        squares_[i] += value * value;
      }
    }
  }

  int pictures() const { return count_; }
  // The work of one of them; so much a path.
  double work() const { return work_.total() / count_; }
  double work_of_path() const { return work() / paths(); }
  double paths() const { return static_cast<double>(image_.width) * image_.height * image_.samples; }
  // Work times mean squared error: the work for an error of 1.
  double cost() const {
    double variance = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i) variance += squares_[i] - sum_[i] * sum_[i] / count_;
    return work() * std::max(variance, 0.0) / (count_ - 1);
  }
  // The mean value of a picture, times a constant.
  double light() const { return std::accumulate(sum_.begin(), sum_.end(), 0.0) / count_; }
  Integrator integrator() const { return image_.integrator; }

 private:
  std::uint64_t seed_;
  ImageSettings image_;
  Work work_;
  int count_ = 0;
  std::vector<double> sum_, squares_;  // per value of a picture
};

// A glance is enough, if the better is not quiet for want of light.
bool clearly_worse(const Pilot& worse, const Pilot& better) {
  return worse.cost() > kClearlyBetter * better.cost() && worse.light() < kClearlyBetter * better.light();
}

// How many pictures of a longer look the budget allows.
int affordable(const RenderSetup& setup, double budget, const Pilot& pilot) {
  const double paths = Pilot(setup, pilot.integrator(), kSamples).paths();
  return static_cast<int>(std::min<double>(budget / (pilot.work_of_path() * paths), kMost));
}

// Instead of what the pilot knows.
void look_longer(const RenderSetup& setup, const Shoot& shoot, int pictures, Pilot& pilot) {
  pilot = Pilot(setup, pilot.integrator(), kSamples);
  pilot.look(pictures, shoot);
}

std::string told(const Pilot& taken, const Pilot& left, double times) {
  char text[160];
  std::snprintf(text, sizeof text,
                "%s takes %.2f times the work for the same error, by %d and %d small pictures",
                name_of(left.integrator()), times, left.pictures(), taken.pictures());
  return text;
}

bool has_mirrors(const RenderSetup& setup) {
  return std::any_of(setup.surfaces.begin(), setup.surfaces.end(), [](const Surface& surface) {
    return surface.kind == SurfaceKind::mirror || surface.kind == SurfaceKind::dielectric;
  });
}

}  // namespace

double Work::total() const { return static_cast<double>(rays) + kTurn * static_cast<double>(turns); }

// Light subpaths alone see nothing in mirrors, and end after so many scatterings.
std::vector<Integrator> candidates(const RenderSetup& setup) {
  std::vector<Integrator> all = {Integrator::path, Integrator::bidirectional};
  if (setup.image.max_bounces < setup.image.light_bounces && !has_mirrors(setup))
    all.push_back(Integrator::light);
  return all;
}

Choice choose_integrator(const RenderSetup& setup, const Shoot& shoot) {
  const std::vector<Integrator> all = candidates(setup);
  Pilot best(setup, all.front());
  best.look(kGlance, shoot);
  const double paths = static_cast<double>(setup.image.width) * setup.image.height * setup.image.samples;
  const double whole = paths * best.work_of_path();
  std::string why;
  for (std::size_t k = 1; k < all.size(); ++k) {
    Pilot other(setup, all[k]);
    if (!why.empty()) why += "; ";
    other.look(1, shoot);
    if (other.work() > kTooDear * whole) {
      why += std::string(name_of(all[k])) + " is too slow to be tried for so small a picture";
      continue;
    }
    other.look(kGlance - 1, shoot);
    const int others = affordable(setup, 0.5 * kBudget * whole, other),
              bests = affordable(setup, 0.5 * kBudget * whole, best);
    const bool longer = !clearly_worse(other, best) && std::min(others, bests) >= kGlance;
    if (longer) {  // both, or they cannot be compared
      look_longer(setup, shoot, others, other);
      look_longer(setup, shoot, bests, best);
    }
    const double times = other.cost() / best.cost();
    const bool better = longer ? times < kBetter : clearly_worse(best, other);
    why += better ? told(other, best, 1 / times) : told(best, other, times);
    if (better) best = other;
  }
  return {best.integrator(), why};
}

}  // namespace firn
