// SPDX-License-Identifier: MIT
// Light as photons that walk through a homogeneous medium, by the flights and phase function of the renderer
// alone: what a picture does not show (lengths, collisions, depths), and many wavelengths by one walk.
#pragma once
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "src/core/rng.h"
#include "src/render/sampling/sampler.h"
#include "src/render/solids/media.h"
#include "tests/light/estimate.h"

namespace firn::test {

// What lies below height 0, or a slab 1 m thick there. tau: its optical thickness; infinite: as deep as one
// likes, with a mean free path of 1 m.
Medium slab(double albedo, double g, double tau);

// Random numbers of one walk.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : seed_(seed) {}
  std::uint64_t key() { return mix64(seed_ + 0x9e3779b97f4a7c15ull * ++count_); }
  Sample2 pair() {
    const std::uint64_t bits = key();
    return {static_cast<float>(bits >> 40) * 0x1p-24f, static_cast<float>(bits >> 8 & 0xffffff) * 0x1p-24f};
  }

 private:
  std::uint64_t seed_, count_ = 0;
};

// Of the `size` values that walk(photon) gives as an array, by many photons; the same for any number of
// threads.
template <class Walk>
std::vector<Estimate> means_of(std::uint64_t photons, Eigen::Index size, const Walk& walk) {
  using Values = std::decay_t<decltype(walk(photons))>;
  constexpr std::uint64_t kChunks = 64;
  const Values zero = Values::Zero(size);
  std::vector<Values> sums(kChunks, zero), squares(kChunks, zero);
  tbb::parallel_for(std::uint64_t{0}, kChunks, [&](std::uint64_t chunk) {
    for (std::uint64_t photon = chunk; photon < photons; photon += kChunks) {
      const Values value = walk(photon);
      sums[chunk] += value;
      squares[chunk] += value.square();
    }
  });
  Values sum = zero, square = zero;
  for (std::uint64_t chunk = 0; chunk < kChunks; ++chunk) sum += sums[chunk], square += squares[chunk];
  std::vector<Estimate> means;
  const auto n = static_cast<double>(photons);
  for (Eigen::Index k = 0; k < size; ++k) {
    const double mean = sum[k] / n;
    means.push_back({mean, std::sqrt(std::max(square[k] / n - mean * mean, 0.0) / n)});
  }
  return means;
}
template <class Walk>
Estimate mean_of(std::uint64_t photons, const Walk& walk) {
  using One = Eigen::Array<double, 1, 1>;
  return means_of(photons, 1, [&](std::uint64_t photon) { return One(walk(photon)); })[0];
}

}  // namespace firn::test
