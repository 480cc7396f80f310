// SPDX-License-Identifier: MIT
#include "kernels/trace/table.h"

namespace firn::kernels::FIRN_ISA {

TraceKernels trace_kernels() { return {}; }

}  // namespace firn::kernels::FIRN_ISA
