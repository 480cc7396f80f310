// SPDX-License-Identifier: MIT
#include "src/io/checkpoint.h"

#include "src/io/byte_stream.h"
#include "src/io/file.h"
#include "src/io/particle_file.h"

namespace firn {
namespace {

constexpr std::string_view kMagic = "FIRNCKPT";
constexpr std::uint32_t kVersion = 3;

void put_sized(std::string& file, std::string_view bytes) {
  put(file, static_cast<std::uint64_t>(bytes.size()));
  file += bytes;
}

std::string_view take_sized(ByteReader& in) { return in.take(in.get<std::uint64_t>()); }

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint) {
  std::string file(kMagic);
  put(file, kVersion);
  put(file, checkpoint.scene_hash);
  put(file, static_cast<std::int32_t>(checkpoint.frame));
  put(file, checkpoint.particle_steps);
  put(file, static_cast<std::uint32_t>(checkpoint.pending.size()));
  for (const auto& [record, snow] : checkpoint.pending) {
    put_sized(file, encode_record(record));
    put_sized(file, encode_snapshot(snow));
  }
  put(file, static_cast<std::uint64_t>(checkpoint.state.size()));
  // The state is most of the simulation's memory: it is written from where it lies.
  std::string_view pieces[] = {file, checkpoint.state, {}};
  std::string hash;
  put(hash, hash_pieces(pieces));
  pieces[2] = hash;
  write_pieces(path, pieces);
}

Checkpoint read_checkpoint(const std::filesystem::path& path, std::uint64_t scene_hash) {
  const std::string file = read_file(path);
  ByteReader in(file, path.string());
  if (in.take(kMagic.size()) != kMagic) in.fail("not a checkpoint of firn");
  if (const auto version = in.get<std::uint32_t>(); version != kVersion) {
    in.fail("checkpoint version " + std::to_string(version) + ", this firn reads version " +
            std::to_string(kVersion));
  }
  const std::size_t body = file.size() - sizeof(std::uint64_t);
  ByteReader tail(std::string_view(file).substr(body), path.string());
  if (tail.get<std::uint64_t>() != hash_bytes(file.data(), body))
    in.fail("damaged checkpoint: wrong checksum");

  Checkpoint checkpoint;
  checkpoint.scene_hash = in.get<std::uint64_t>();
  if (checkpoint.scene_hash != scene_hash) in.fail("this checkpoint belongs to another scene");
  checkpoint.frame = in.get<std::int32_t>();
  checkpoint.particle_steps = in.get<std::uint64_t>();
  const auto pending = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < pending; ++i) {
    PendingFrame& frame = checkpoint.pending.emplace_back();
    frame.record = decode_record(take_sized(in), path.string());
    frame.snow = decode_snapshot(take_sized(in), path.string());
    const int before = i == 0 ? -1 : checkpoint.pending[i - 1].snow.frame;
    if (frame.snow.frame <= before || frame.snow.frame > checkpoint.frame ||
        frame.record.frame != frame.snow.frame)
      in.fail("damaged checkpoint: its pending frames are out of order");
  }
  checkpoint.state = take_sized(in);
  return checkpoint;
}

}  // namespace firn
