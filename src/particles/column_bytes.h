// SPDX-License-Identifier: MIT
// How far columns lie apart in one allocation.
#pragma once
#include <cstddef>

namespace firn {

inline constexpr std::size_t kCacheLine = 64;  // bytes

// From one column of `count` entries of `size` bytes to the next: whole cache lines, and one more, so that
// streams of several columns do not alias.
constexpr std::size_t column_bytes(std::size_t count, std::size_t size) {
  return (count * size + kCacheLine - 1) / kCacheLine * kCacheLine + kCacheLine;
}

}  // namespace firn
