// SPDX-License-Identifier: MIT
#include "src/core/memory.h"

#include <unistd.h>

namespace firn {

std::uint64_t machine_memory() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace firn
