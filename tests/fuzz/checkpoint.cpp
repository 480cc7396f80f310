// SPDX-License-Identifier: MIT
// As particle files: once as it is, once with its checksum put right. The law is theirs too.
#include "src/io/checkpoint.h"

#include <cstring>
#include <string>

#include "firn/error.h"
#include "src/io/file.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

constexpr std::size_t kSceneHash = 12;  // bytes, as src/io/checkpoint.h has it

void read(std::string_view bytes) {
  std::uint64_t scene = 0;
  if (bytes.size() >= kSceneHash + sizeof scene) std::memcpy(&scene, bytes.data() + kSceneHash, sizeof scene);
  try {
    const Checkpoint checkpoint = read_checkpoint(MemoryFile(bytes).path(), scene);
    require(checkpoint.scene_hash == scene, "a checkpoint is of the scene that was asked for");
    require(checkpoint.state.size() <= bytes.size(), "a state is not longer than its file");
  } catch (const Error&) {
  }
}

}  // namespace

void checkpoint(std::string_view input) {
  read(input);
  std::string whole(input);
  const std::uint64_t hash = hash_bytes(whole.data(), whole.size());
  read(whole.append(reinterpret_cast<const char*>(&hash), sizeof hash));
}

}  // namespace firn::fuzz
