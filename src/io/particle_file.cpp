// SPDX-License-Identifier: MIT
#include "src/io/particle_file.h"

#include "src/io/byte_stream.h"
#include "src/io/file.h"
#include "src/particles/snapshot.h"

namespace firn {
namespace {

constexpr std::string_view kMagic = "FIRNSNAP";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHashOffset = 64;
constexpr std::size_t kBytesPerParticle =
    8 * sizeof(float) + 3 * sizeof(std::int16_t) + sizeof(std::uint32_t) + sizeof(std::uint16_t);

template <class T>
std::string_view bytes_of(std::span<T> column) {
  return {reinterpret_cast<const char*>(column.data()), column.size_bytes()};
}

// The hash of a file image with its hash field left out.
std::uint64_t content_hash(std::string_view file) {
  const std::uint64_t parts[2] = {hash_bytes(file.data(), kHashOffset),
                                  hash_bytes(file.data() + kHashOffset + 8, file.size() - kHashOffset - 8)};
  return hash_bytes(parts, sizeof parts);
}

}  // namespace

std::string encode_snapshot(const Snapshot& snapshot) {
  std::string file(kMagic);
  file.reserve(kHashOffset + 8 + kBytesPerParticle * snapshot.size());
  put(file, kVersion);
  put(file, static_cast<std::int32_t>(snapshot.frame));
  put(file, snapshot.time);
  for (int axis = 0; axis < 3; ++axis) put(file, snapshot.origin[axis]);
  put(file, snapshot.dx);
  put(file, static_cast<std::uint64_t>(snapshot.size()));
  put(file, std::uint64_t{0});
  for_each_stored_column(snapshot, [&](auto column) { file += bytes_of(column); });
  const std::uint64_t hash = content_hash(file);
  std::memcpy(file.data() + kHashOffset, &hash, sizeof hash);
  return file;
}

Snapshot decode_snapshot(std::string_view bytes, const std::string& where) {
  ByteReader in(bytes, where);
  if (in.take(kMagic.size()) != kMagic) in.fail("not a particle file of firn");
  if (const auto version = in.get<std::uint32_t>(); version != kVersion) {
    in.fail("particle file version " + std::to_string(version) + ", this firn reads version " +
            std::to_string(kVersion));
  }
  Snapshot snapshot;
  snapshot.frame = in.get<std::int32_t>();
  snapshot.time = in.get<double>();
  for (int axis = 0; axis < 3; ++axis) snapshot.origin[axis] = in.get<double>();
  snapshot.dx = in.get<double>();
  const auto count = in.get<std::uint64_t>();
  const auto hash = in.get<std::uint64_t>();
  if (in.left() / kBytesPerParticle != count || in.left() % kBytesPerParticle != 0) {
    in.fail("damaged particle file: its length does not fit its " + std::to_string(count) + " particles");
  }
  if (hash != content_hash(bytes)) in.fail("damaged particle file: wrong checksum");
  snapshot.resize(count);
  for_each_stored_column(snapshot, [&](auto column) {
    const std::size_t size = column.size_bytes();
    if (size) std::memcpy(column.data(), in.take(size).data(), size);
  });
  return snapshot;
}

void write_particle_file(const std::filesystem::path& path, const Snapshot& snapshot) {
  write_file(path, encode_snapshot(snapshot));
}

Snapshot read_particle_file(const std::filesystem::path& path) {
  return decode_snapshot(read_file(path), path.string());
}

}  // namespace firn
