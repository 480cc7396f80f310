// SPDX-License-Identifier: MIT
// Counter-based random numbers: a value is a pure function of its keys, never of who asked before.
// Mixing by the finaliser of SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number
// generators").
#pragma once
#include <bit>
#include <cstdint>

namespace firn {

constexpr std::uint64_t mix64(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

// A hash of any number of integer keys, order-sensitive.
template <class... Keys>
constexpr std::uint64_t hash_keys(std::uint64_t first, Keys... rest) {
  std::uint64_t h = mix64(first);
  ((h = mix64(h ^ static_cast<std::uint64_t>(rest))), ...);
  return h;
}

// The bits of a number as a key of a hash.
constexpr std::uint64_t key_of(double value) { return std::bit_cast<std::uint64_t>(value); }

// Uniform in [0, 1), 24 bits for float and 53 for double.
constexpr float uniform_float(std::uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }
constexpr double uniform_double(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

}  // namespace firn
