// SPDX-License-Identifier: MIT
// Low-discrepancy points from counters: the first two Sobol dimensions, Owen-scrambled by hashing
// (kernels/shade/sobol.h), a fresh scramble and a shuffled order for every pair of dimensions. A value
// depends on (seed, frame, pixel, sample, pair) alone, so noise does not know of threads or tiles.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/shade/sobol.h"
#include "kernels/shade/table.h"
#include "src/core/rng.h"
#include "src/render/setup.h"

namespace firn {

struct Sample2 {
  float u, v;  // in [0, 1)
};

class Sampler {
 public:
  Sampler(std::uint64_t seed, std::uint64_t frame, std::uint64_t pixel)
      : key_(hash_keys(seed, frame, pixel)) {}

  Sample2 pair(std::uint32_t sample, std::uint32_t dimension_pair) const {
    const std::uint64_t order = mix64(key_ ^ (0x9e3779b97f4a7c15ull * (dimension_pair + 1)));
    const std::uint64_t digits = mix64(order);
    const auto scramble = [](std::uint32_t x, std::uint64_t seed) {
      return kernels::reverse_bits(kernels::scramble_reversed(x, static_cast<std::uint32_t>(seed)));
    };
    const std::uint32_t index = scramble(kernels::reverse_bits(sample), order);
    const std::uint32_t u = scramble(index, digits),
                        v = scramble(kernels::sobol_second_reversed(index), digits >> 32);
    return {static_cast<float>(u >> 8) * 0x1p-24f, static_cast<float>(v >> 8) * 0x1p-24f};
  }
  // Without any order between samples: for the thousandth collision of a path none is left to be had.
  Sample2 independent_pair(std::uint32_t sample, std::uint32_t dimension_pair) const {
    const std::uint64_t bits = key(sample, dimension_pair);
    return {static_cast<float>(bits >> 40) * 0x1p-24f, static_cast<float>(bits >> 8 & 0xffffff) * 0x1p-24f};
  }
  std::uint64_t key(std::uint32_t sample, std::uint32_t number) const {
    return mix64(key_ ^ mix64(static_cast<std::uint64_t>(number) << 32 | sample));
  }
  std::uint64_t key() const { return key_; }

 private:
  std::uint64_t key_;
};

// The random numbers of one path.
class PathRandom {
 public:
  PathRandom() : PathRandom(Sampler(0, 0, 0), 0, SamplerKind::sobol) {}
  PathRandom(const Sampler& sampler, std::uint32_t sample, SamplerKind kind)
      : sampler_(sampler), sample_(sample), ordered_(kind == SamplerKind::sobol ? kOrderedPairs : 0) {}

  Sample2 pair(std::uint32_t number) const {
    const bool ordered = (number & kWithinSubpath) < ordered_;
    return ordered ? sampler_.pair(sample_, number) : sampler_.independent_pair(sample_, number);
  }
  // For whoever makes more random numbers out of it.
  std::uint64_t key(std::uint32_t number) const { return sampler_.key(sample_, ~number); }

 private:
  friend class PathDraws;
  static constexpr std::uint32_t kOrderedPairs = 40;               // of each subpath
  static constexpr std::uint32_t kWithinSubpath = (1u << 30) - 1;  // the other bits tell which

  Sampler sampler_;
  std::uint32_t sample_;
  std::uint32_t ordered_;
};

// Which random numbers of which paths, all of one kind of sampler: for the kernels that draw many at once.
class PathDraws {
 public:
  void clear() { key_.clear(), sample_.clear(), number_.clear(); }
  void push(const PathRandom& random, std::uint32_t number) {
    key_.push_back(random.sampler_.key());
    sample_.push_back(random.sample_);
    number_.push_back(number);
    ordered_ = random.ordered_;
  }
  std::size_t size() const { return key_.size(); }
  kernels::DrawView view() const {
    return {key_.data(), sample_.data(), number_.data(), PathRandom::kWithinSubpath, ordered_};
  }

 private:
  std::vector<std::uint64_t> key_;
  std::vector<std::uint32_t> sample_, number_;
  std::uint32_t ordered_ = 0;
};

}  // namespace firn
