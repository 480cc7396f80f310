// SPDX-License-Identifier: MIT
// What was built and where it runs, for the manifest, `firn info` and --version.
#pragma once
#include <string>

#include "firn/version.h"

namespace firn {

std::string compiler();    // "GCC 12.2.0"
std::string build_type();  // meson's: "release", "debug", ...
std::string cpu_name();    // as /proc/cpuinfo names it, or "unknown"
std::string utc_now();     // "2026-01-31T12:00:00Z"

}  // namespace firn
