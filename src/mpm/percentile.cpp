// SPDX-License-Identifier: MIT
#include "src/mpm/percentile.h"

#include <bit>
#include <cstdint>

namespace firn {
namespace {

// Unsigned integers in the order of the floats, and back.
std::uint32_t key(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  return bits >> 31 ? ~bits : bits | 0x80000000u;
}
float value_of(std::uint32_t key) { return std::bit_cast<float>(key >> 31 ? key & 0x7fffffffu : ~key); }

constexpr std::size_t kBins = std::size_t{1} << 16;

// The first bin at which the sum of the bins reaches `wanted`, which is lessened by the bins before it.
std::uint32_t find_bin(const std::vector<double>& bins, double& wanted) {
  std::uint32_t last = 0;  // that holds anything: round-off may leave `wanted` above the sum
  for (std::uint32_t b = 0; b < kBins; ++b) {
    if (bins[b] == 0) continue;
    last = b;
    if (bins[b] >= wanted) return b;
    wanted -= bins[b];
  }
  return last;
}

}  // namespace

float mass_percentile(const std::vector<float>& value, const float* mass, double part) {
  if (value.empty()) return 0;
  double wanted = 0;
  std::vector<double> bins(kBins);
  for (std::size_t i = 0; i < value.size(); ++i) bins[key(value[i]) >> 16] += mass[i];
  for (const double bin : bins) wanted += part * bin;
  const std::uint32_t upper = find_bin(bins, wanted);
  bins.assign(kBins, 0);
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::uint32_t k = key(value[i]);
    if (k >> 16 == upper) bins[k & 0xffffu] += mass[i];
  }
  return value_of(upper << 16 | find_bin(bins, wanted));
}

}  // namespace firn
