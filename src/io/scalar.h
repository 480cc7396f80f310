// SPDX-License-Identifier: MIT
// Numbers of the types that PLY and NumPy files have, of either byte order, as doubles. Whole numbers beyond
// 2^53 lose their last bits.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace firn {

struct ScalarType {
  enum class Kind : char { real, integer, natural } kind;
  std::size_t bytes;  // real: 4, 8; else 1, 2, 4, 8
  bool big_endian;
};

template <class T>
double scalar_as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

inline double read_scalar(const ScalarType& type, const char* bytes) {
  char little[8] = {};
  std::memcpy(little, bytes, type.bytes);
  if (type.big_endian) std::reverse(little, little + type.bytes);
  if (type.kind == ScalarType::Kind::real)
    return type.bytes == 4 ? scalar_as<float>(little) : scalar_as<double>(little);
  const bool with_sign = type.kind == ScalarType::Kind::integer;
  switch (type.bytes) {
    case 1:
      return with_sign ? scalar_as<std::int8_t>(little) : scalar_as<std::uint8_t>(little);
    case 2:
      return with_sign ? scalar_as<std::int16_t>(little) : scalar_as<std::uint16_t>(little);
    case 4:
      return with_sign ? scalar_as<std::int32_t>(little) : scalar_as<std::uint32_t>(little);
    default:
      return with_sign ? scalar_as<std::int64_t>(little) : scalar_as<std::uint64_t>(little);
  }
}

}  // namespace firn
