// SPDX-License-Identifier: MIT
// Files of points made byte by byte: arrays and archives as NumPy writes them, and what no program writes.
#pragma once
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "src/io/byte_stream.h"

namespace firn::test {

// `type`: "<f8" and the like; `bytes`: the values.
inline std::string npy(const std::string& type, const std::string& shape, const std::string& bytes,
                       bool fortran = false, int version = 1) {
  std::string head = "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") +
                     ", 'shape': " + shape + ", }";
  head.resize(117, ' ');
  head += '\n';
  std::string file = "\x93NUMPY";
  file += static_cast<char>(version);
  file += '\0';
  if (version == 1) put(file, static_cast<std::uint16_t>(head.size()));
  if (version > 1) put(file, static_cast<std::uint32_t>(head.size()));
  return file + head + bytes;
}

template <class T>
std::string raw(const std::vector<T>& values, bool big_endian = false) {
  std::string bytes;
  for (const T& value : values) {
    std::string one;
    put(one, value);
    bytes += big_endian ? std::string(one.rbegin(), one.rend()) : one;
  }
  return bytes;
}

inline std::string deflated(const std::string& bytes) {
  std::string packed(bytes.size() + 100, '\0');
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

struct ZipLayout {
  bool deflate = false;
  bool zip64 = false;        // sizes, places and the directory in 64 bits
  bool descriptors = false;  // a member's sizes after it
  std::uint64_t claim = 0;   // added to the size that the directory tells
  std::string comment = {};
};

inline std::string zip(const std::vector<std::pair<std::string, std::string>>& members,
                       const ZipLayout& layout = {}) {
  std::string file, directory;
  const auto put16 = [](std::string& s, std::size_t v) { put(s, static_cast<std::uint16_t>(v)); };
  const auto put32 = [](std::string& s, std::size_t v) { put(s, static_cast<std::uint32_t>(v)); };
  const auto put64 = [](std::string& s, std::size_t v) { put(s, static_cast<std::uint64_t>(v)); };
  for (const auto& [name, bytes] : members) {
    const std::string body = layout.deflate ? deflated(bytes) : bytes;
    const auto crc =
        static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
    const std::size_t start = file.size(), size = bytes.size() + layout.claim, wide = 0xffffffff;
    put32(file, 0x04034b50);
    for (const std::size_t v : {std::size_t{45}, std::size_t{layout.descriptors ? 8u : 0u},
                                std::size_t{layout.deflate ? 8u : 0u}, std::size_t{0}, std::size_t{0}})
      put16(file, v);
    put32(file, layout.descriptors ? 0 : crc);
    for (const std::size_t v : {body.size(), bytes.size()})
      put32(file, layout.descriptors ? 0 : layout.zip64 ? wide : v);
    put16(file, name.size());
    put16(file, layout.zip64 ? 20 : 0);
    file += name;
    if (layout.zip64) {
      put16(file, 1), put16(file, 16);
      put64(file, bytes.size()), put64(file, body.size());
    }
    file += body;
    if (layout.descriptors)
      put32(file, 0x08074b50), put32(file, crc), put32(file, body.size()), put32(file, size);
    put32(directory, 0x02014b50);
    for (const std::size_t v : {std::size_t{45}, std::size_t{45}, std::size_t{layout.descriptors ? 8u : 0u},
                                std::size_t{layout.deflate ? 8u : 0u}, std::size_t{0}, std::size_t{0}})
      put16(directory, v);
    put32(directory, crc);
    put32(directory, layout.zip64 ? wide : body.size());
    put32(directory, layout.zip64 ? wide : size);
    put16(directory, name.size());
    put16(directory, layout.zip64 ? 28 : 0);
    for (int k = 0; k < 3; ++k) put16(directory, 0);
    put32(directory, 0);
    put32(directory, layout.zip64 ? wide : start);
    directory += name;
    if (layout.zip64) {
      put16(directory, 1), put16(directory, 24);
      put64(directory, size), put64(directory, body.size()), put64(directory, start);
    }
  }
  const std::size_t start = file.size();
  file += directory;
  if (layout.zip64) {
    const std::size_t end = file.size();
    put32(file, 0x06064b50), put64(file, 44), put16(file, 45), put16(file, 45), put32(file, 0),
        put32(file, 0);
    put64(file, members.size()), put64(file, members.size()), put64(file, directory.size()),
        put64(file, start);
    put32(file, 0x07064b50), put32(file, 0), put64(file, end), put32(file, 1);
  }
  put32(file, 0x06054b50), put16(file, 0), put16(file, 0);
  put16(file, layout.zip64 ? 0xffff : members.size()), put16(file, layout.zip64 ? 0xffff : members.size());
  put32(file, layout.zip64 ? 0xffffffff : directory.size());
  put32(file, layout.zip64 ? 0xffffffff : start);
  put16(file, layout.comment.size());
  return file + layout.comment;
}

}  // namespace firn::test
