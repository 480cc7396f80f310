// SPDX-License-Identifier: MIT
// One table of function pointers per instruction set. src/core/isa.h chooses one at start and everything
// above passes it down by reference: nothing outside kernels/ names an instruction set.
#pragma once
#include "kernels/mpm/table.h"
#include "kernels/shade/table.h"
#include "kernels/trace/table.h"

namespace firn::kernels {

struct KernelTable {
  const char* isa;     // "base", "x86-64-v3", "x86-64-v4"
  MpmKernels mpm;      // particles <-> grid
  TraceKernels trace;  // rays <-> particles
  ShadeKernels shade;  // points of the snow's surface
};

namespace isa_base {
const KernelTable& table();
}
namespace isa_v3 {
const KernelTable& table();
}
namespace isa_v4 {
const KernelTable& table();
}

}  // namespace firn::kernels
