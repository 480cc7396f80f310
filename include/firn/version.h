// SPDX-License-Identifier: MIT
// Which firn this is. The functions tell of the library that runs, the macros of the headers that a program
// was compiled with. Thread-safe.
#pragma once
#include <string>

#include "firn/export.h"

// Of the headers that a program is compiled with.
#define FIRN_VERSION_MAJOR 0
#define FIRN_VERSION_MINOR 2
#define FIRN_VERSION_PATCH 0

namespace firn {

FIRN_API std::string version();   // "0.2.0"
FIRN_API std::string revision();  // git commit, "-dirty" if changed, or "unknown"

}  // namespace firn
