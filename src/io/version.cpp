// SPDX-License-Identifier: MIT
#include "src/io/version.h"

#include <chrono>
#include <ctime>
#include <fstream>
#include <string_view>

#include "build_facts.h"
#include "revision.h"

#define FIRN_QUOTED(x) #x
#define FIRN_TEXT(x) FIRN_QUOTED(x)
#define FIRN_VERSION_TEXT       \
  FIRN_TEXT(FIRN_VERSION_MAJOR) \
  "." FIRN_TEXT(FIRN_VERSION_MINOR) "." FIRN_TEXT(FIRN_VERSION_PATCH)

namespace firn {

static_assert(std::string_view(FIRN_VERSION) == FIRN_VERSION_TEXT,
              "firn/version.h and meson.build name one version");

std::string version() { return FIRN_VERSION; }
std::string revision() { return FIRN_REVISION; }
std::string build_type() { return FIRN_BUILD_TYPE; }

std::string compiler() {
#if defined(__clang__)
  return std::string("Clang ") + __clang_version__;
#else
  return std::string("GCC ") + __VERSION__;
#endif
}

std::string cpu_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace firn
