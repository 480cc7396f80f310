// SPDX-License-Identifier: MIT
// Where libFuzzer enters; compiled once for each reader (FIRN_READER) of readers.h.
#include <cstddef>
#include <cstdint>

#include "firn/error.h"
#include "tests/fuzz/readers.h"

// libFuzzer declares it in no header.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  try {
    firn::fuzz::FIRN_READER({reinterpret_cast<const char*>(bytes), size});
  } catch (const firn::Error&) {
  }
  return 0;
}
