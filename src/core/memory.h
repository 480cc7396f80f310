// SPDX-License-Identifier: MIT
#pragma once
#include <cstdint>

namespace firn {

inline constexpr double kBytesPerGibibyte = 1 << 30;

std::uint64_t machine_memory();  // bytes, of the whole machine
std::uint64_t peak_memory();  // bytes, that this process has held at once up to now; 0 if Linux does not say

}  // namespace firn
