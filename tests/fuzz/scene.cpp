// SPDX-License-Identifier: MIT
// The law: a scene that was read is written with all its defaults as a scene that is read to the same one.
#include "src/scene/scene.h"

#include <sstream>
#include <string>

#include "firn/error.h"
#include "tests/fuzz/readers.h"

namespace firn::fuzz {
namespace {

ReadOptions options_of(std::string_view lines) {
  ReadOptions options;
  std::istringstream in{std::string(lines)};
  for (std::string line; std::getline(in, line);) {
    const auto equals = line.find('=');
    if (line == "quick") {
      options.quick = true;
    } else if (equals != std::string::npos) {
      options.overrides.push_back({line.substr(0, equals), line.substr(equals + 1)});
    }
  }
  return options;
}

std::string read_again(const std::string& resolved) {
  try {
    return resolved_toml(read_scene_text(resolved, "fuzz.toml", {}));
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n%s\n", resolved.c_str(), error.what());
    require(false, "a resolved scene can be read");
    throw;
  }
}

}  // namespace

void scene(std::string_view input) {
  const auto end = input.find('\0');
  const std::string text(input.substr(0, end));
  const std::string_view lines = end == std::string_view::npos ? std::string_view() : input.substr(end + 1);
  const std::string resolved = resolved_toml(read_scene_text(text, "fuzz.toml", options_of(lines)));
  const std::string again = read_again(resolved);
  if (again != resolved) std::fprintf(stderr, "%s\n-- read again:\n%s\n", resolved.c_str(), again.c_str());
  require(again == resolved, "a resolved scene reads to itself");
}

}  // namespace firn::fuzz
