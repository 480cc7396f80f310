// SPDX-License-Identifier: MIT
// Inputs that a fuzzer once found wanting, and some that are nothing at all, through the same readers.
#include <filesystem>
#include <string>

#include "firn/error.h"
#include "src/io/file.h"
#include "tests/catch.h"
#include "tests/fuzz/readers.h"

using namespace firn;

namespace {

struct Reader {
  const char* name;
  void (*read)(std::string_view);
};
constexpr Reader kReaders[] = {
    {"scene", fuzz::scene},           {"mesh", fuzz::mesh},           {"heights", fuzz::heights},
    {"images", fuzz::images},         {"particles", fuzz::particles}, {"points", fuzz::points},
    {"checkpoint", fuzz::checkpoint}, {"state", fuzz::state},         {"manifest", fuzz::manifest},
    {"journal", fuzz::journal},
};

// Whether the reader took it; an Error is an answer, anything else ends the test.
bool took(const Reader& reader, std::string_view input) {
  try {
    reader.read(input);
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

TEST_CASE("Every input that once failed is read or refused with an Error") {
  for (const Reader& reader : kReaders) {
    const auto folder = std::filesystem::path(FIRN_SOURCE_ROOT) / "tests/fuzz/regressions" / reader.name;
    if (!std::filesystem::exists(folder)) continue;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      INFO(file.path().string());
      CHECK_NOTHROW(took(reader, read_file(file.path())));
    }
  }
}

TEST_CASE("No reader takes an empty file or a run of one byte for anything but an Error") {
  for (const Reader& reader : kReaders) {
    INFO(reader.name);
    CHECK_NOTHROW(took(reader, ""));
    for (const char byte : {'\0', '\n', '[', '{', 'P', 'v', '\xff'}) {
      CHECK_NOTHROW(took(reader, std::string(200, byte)));
    }
  }
}
