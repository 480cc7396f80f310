// SPDX-License-Identifier: MIT
// No random text passes its hash, so each input is read as it is and once more with its hash put right.
#include "src/io/manifest.h"

#include <algorithm>
#include <string>

#include "firn/error.h"
#include "src/io/file.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

std::string with_hash(std::string_view input) {
  const std::string text(input.substr(0, std::min(input.rfind(",\n \"hash\""), input.rfind("\n}"))));
  return text + ",\n \"hash\": \"" + hash_in_hex(text) + "\"\n}\n";
}

}  // namespace

void manifest(std::string_view input) {
  try {
    read_manifest(MemoryFile(input).path(), "");
  } catch (const Error&) {
  }
  read_manifest(MemoryFile(with_hash(input)).path(), "");
}

}  // namespace firn::fuzz
