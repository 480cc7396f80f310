// SPDX-License-Identifier: MIT
// Low-discrepancy points from counters: the first two Sobol dimensions, Owen-scrambled by hashing (Laine &
// Karras 2011; Burley 2020, "Practical hash-based Owen scrambling"), a fresh scramble and a shuffled order
// for every pair of dimensions. A value depends on (seed, frame, pixel, sample, pair) alone, so noise does
// not know of threads or tiles.
#pragma once
#include <cstdint>

#include "src/core/rng.h"
#include "src/render/setup.h"

namespace firn {

struct Sample2 {
  float u, v;  // in [0, 1)
};

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x >> 16) | (x << 16);
  x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
  x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
  return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
}

// A random binary tree of swaps, applied to the digits of x from its last bit on: an Owen scramble keeps
// every dyadic stratum.
constexpr std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

// Second Sobol dimension, bits reversed: digit j is the sum modulo 2 of the index's bits i with C(i, j) odd,
// that is i a superset of j. The first, reversed, is the index itself.
constexpr std::uint32_t sobol_second_reversed(std::uint32_t index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  index ^= index >> 16;
  return index;
}

class Sampler {
 public:
  Sampler(std::uint64_t seed, std::uint64_t frame, std::uint64_t pixel)
      : key_(hash_keys(seed, frame, pixel)) {}

  Sample2 pair(std::uint32_t sample, std::uint32_t dimension_pair) const {
    const std::uint64_t order = mix64(key_ ^ (0x9e3779b97f4a7c15ull * (dimension_pair + 1)));
    const std::uint64_t digits = mix64(order);
    const auto scramble = [](std::uint32_t x, std::uint64_t seed) {
      return reverse_bits(scramble_reversed(x, static_cast<std::uint32_t>(seed)));
    };
    const std::uint32_t index = scramble(reverse_bits(sample), order);
    const std::uint32_t u = scramble(index, digits), v = scramble(sobol_second_reversed(index), digits >> 32);
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
  static constexpr std::uint32_t kOrderedPairs = 40;               // of each subpath
  static constexpr std::uint32_t kWithinSubpath = (1u << 30) - 1;  // the other bits tell which

  Sampler sampler_;
  std::uint32_t sample_;
  std::uint32_t ordered_;
};

}  // namespace firn
