// SPDX-License-Identifier: MIT
// No random input passes a checksum, so each one is read as it is and once more with its checksum put right.
// The law: what was read is written as the same bytes.
#include <cstring>
#include <string>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/particle_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

constexpr std::size_t kHash = 64, kColumns = 72;  // bytes, as src/io/particle_file.h has it

void read(std::string_view bytes) {
  try {
    const Snapshot snapshot = decode_snapshot(bytes, "input");
    require(encode_snapshot(snapshot) == bytes, "a particle file that was read is written as the same bytes");
  } catch (const Error&) {
  }
}

}  // namespace

void particles(std::string_view input) {
  read(input);
  if (input.size() < kColumns) return;
  std::string whole(input);
  const std::uint64_t parts[2] = {hash_bytes(whole.data(), kHash),
                                  hash_bytes(whole.data() + kColumns, whole.size() - kColumns)};
  const std::uint64_t hash = hash_bytes(parts, sizeof parts);
  std::memcpy(whole.data() + kHash, &hash, sizeof hash);
  read(whole);
}

}  // namespace firn::fuzz
