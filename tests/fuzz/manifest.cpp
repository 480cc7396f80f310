// SPDX-License-Identifier: MIT
#include "src/io/manifest.h"

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {

void manifest(std::string_view input) { read_manifest(MemoryFile(input).path(), ""); }

}  // namespace firn::fuzz
