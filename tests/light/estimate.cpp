// SPDX-License-Identifier: MIT
#include "tests/light/estimate.h"

#include <algorithm>

#include "src/core/rng.h"
#include "tests/catch.h"

namespace firn::test {

Picture picture_along(RenderSetup setup, const Snapshot& snapshot, const Vec3& position, const Vec3& target,
                      int side, int samples) {
  setup.camera.position = position;
  setup.camera.target = target;
  const bool steep = std::fabs((target - position).normalized().y()) > 0.9;
  setup.camera.up = steep ? Vec3::UnitZ() : Vec3::UnitY();
  setup.camera.fov = 1e-3;
  setup.image.width = setup.image.height = side;
  setup.image.samples = samples;
  // Numbers of their own, so that the scores of a set are independent.
  setup.seed = hash_keys(setup.seed, key_of(position.x()), key_of(position.y()),
                         key_of(setup.media.empty() ? 0 : setup.media[0].sigma_s.x()),
                         key_of(setup.media.empty() ? 0 : setup.media[0].g),
                         static_cast<std::uint64_t>(setup.objects.size()),
                         static_cast<std::uint64_t>(setup.lights[0].index()),
                         key_of(setup.objects.empty() ? 0 : setup.objects[0].shape.pose.translation.y()));
  return render(snapshot, setup);
}

Estimate channel_of(const Picture& picture, std::size_t channel) {
  const int count = picture.width * picture.height;
  double sum = 0, squares = 0;
  for (std::size_t k = channel; k < picture.rgb.size(); k += 3) {
    const double value = picture.rgb[k];
    sum += value;
    squares += value * value;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(squares / count - mean * mean, 0.0) / (count - 1))};
}

Estimate radiance_along(const RenderSetup& setup, const Snapshot& snapshot, const Vec3& position,
                        const Vec3& target, int side, int samples) {
  return channel_of(picture_along(setup, snapshot, position, target, side, samples), 1);
}

double Scores::rms() const {
  double sum = 0;
  for (const double z : z_) sum += z * z;
  return std::sqrt(sum / static_cast<double>(z_.size()));
}

double Scores::largest() const {
  double most = 0;
  for (const double z : z_) most = std::max(most, std::fabs(z));
  return most;
}

std::size_t Scores::beyond(double z) const {
  return static_cast<std::size_t>(
      std::count_if(z_.begin(), z_.end(), [z](double x) { return std::fabs(x) > z; }));
}

void require_unbiased(const Scores& scores) {
  INFO(scores.size() << " scores, rms " << scores.rms() << ", largest " << scores.largest());
  REQUIRE(scores.size() > 0);
  CHECK(scores.largest() < 4.5);
  CHECK(scores.beyond(3) <= std::max<std::size_t>(scores.size() / 100, 1));
  // The rms of n scores scatters by 1 / sqrt(2 n): from 100 on, 0.2 is nearly three of that.
  if (scores.size() >= 100) {
    CHECK(scores.rms() > 0.8);
    CHECK(scores.rms() < 1.2);
  }
}

}  // namespace firn::test
