// SPDX-License-Identifier: MIT
#include "src/io/particle_file.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "src/io/byte_stream.h"
#include "src/io/file.h"
#include "src/particles/snapshot.h"

namespace firn {
namespace {

constexpr std::string_view kMagic = "FIRNSNAP";
constexpr std::uint32_t kVersion = 2, kDrivenVersion = 3;
constexpr std::size_t kHashOffset = 64;
constexpr std::size_t kBytesPerParticle =
    8 * sizeof(float) + 3 * sizeof(std::int16_t) + sizeof(std::uint32_t) + sizeof(std::uint16_t);

template <class T>
std::string_view bytes_of(std::span<T> column) {
  return {reinterpret_cast<const char*>(column.data()), column.size_bytes()};
}

// The numbers of a driven collider, in their order.
template <class AnyCollider, class Visit>
void for_each_number(AnyCollider& c, Visit&& visit) {
  visit(c.time);
  std::for_each(c.position.begin(), c.position.end(), visit);
  std::for_each(c.rotation.begin(), c.rotation.end(), visit);
  for (auto* vector : {&c.velocity, &c.angular_velocity})
    std::for_each(vector->begin(), vector->end(), visit);
  visit(c.dt);
  for (auto* vector : {&c.force, &c.torque}) std::for_each(vector->begin(), vector->end(), visit);
}

void put_driven(std::string& file, const std::vector<DrivenCollider>& driven) {
  for (const DrivenCollider& c : driven) {
    put(file, static_cast<std::uint32_t>(c.name.size()));
    file += c.name;
    for_each_number(c, [&](double number) { put(file, number); });
  }
}

std::vector<DrivenCollider> get_driven(ByteReader& in) {
  std::vector<DrivenCollider> driven;
  while (in.left() > 0) {
    DrivenCollider& c = driven.emplace_back();
    c.name = in.take(in.get<std::uint32_t>());
    for_each_number(c, [&](double& number) {
      number = in.get<double>();
      if (!std::isfinite(number)) in.fail("damaged particle file: a driven collider is nowhere");
    });
  }
  if (driven.empty()) in.fail("damaged particle file: its driven colliders are missing");
  return driven;
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
  put(file, snapshot.driven.empty() ? kVersion : kDrivenVersion);
  put(file, static_cast<std::int32_t>(snapshot.frame));
  put(file, snapshot.time);
  for (int axis = 0; axis < 3; ++axis) put(file, snapshot.origin[axis]);
  put(file, snapshot.dx);
  put(file, static_cast<std::uint64_t>(snapshot.size()));
  put(file, std::uint64_t{0});
  for_each_stored_column(snapshot, [&](auto column) { file += bytes_of(column); });
  put_driven(file, snapshot.driven);
  const std::uint64_t hash = content_hash(file);
  std::memcpy(file.data() + kHashOffset, &hash, sizeof hash);
  return file;
}

Snapshot decode_snapshot(std::string_view bytes, const std::string& where) {
  ByteReader in(bytes, where);
  if (in.take(kMagic.size()) != kMagic) in.fail("not a particle file of firn");
  const auto version = in.get<std::uint32_t>();
  if (version != kVersion && version != kDrivenVersion) {
    in.fail("particle file version " + std::to_string(version) + ", this firn reads versions " +
            std::to_string(kVersion) + " and " + std::to_string(kDrivenVersion));
  }
  Snapshot snapshot;
  snapshot.frame = in.get<std::int32_t>();
  snapshot.time = in.get<double>();
  for (int axis = 0; axis < 3; ++axis) snapshot.origin[axis] = in.get<double>();
  snapshot.dx = in.get<double>();
  const auto count = in.get<std::uint64_t>();
  const auto hash = in.get<std::uint64_t>();
  const bool exact = in.left() / kBytesPerParticle == count && in.left() % kBytesPerParticle == 0;
  if (version == kVersion ? !exact : in.left() / kBytesPerParticle < count) {
    in.fail("damaged particle file: its length does not fit its " + std::to_string(count) + " particles");
  }
  if (hash != content_hash(bytes)) in.fail("damaged particle file: wrong checksum");
  snapshot.resize(count);
  for_each_stored_column(snapshot, [&](auto column) {
    const std::size_t size = column.size_bytes();
    if (size) std::memcpy(column.data(), in.take(size).data(), size);
  });
  if (version == kDrivenVersion) snapshot.driven = get_driven(in);
  return snapshot;
}

void write_particle_file(const std::filesystem::path& path, const Snapshot& snapshot) {
  write_file(path, encode_snapshot(snapshot));
}

Snapshot read_particle_file(const std::filesystem::path& path) {
  return decode_snapshot(read_file(path), path.string());
}

}  // namespace firn
