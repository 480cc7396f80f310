// SPDX-License-Identifier: MIT
#include "kernels/mpm/table.h"

namespace firn::kernels::FIRN_ISA {

MpmKernels mpm_kernels() { return {}; }

}  // namespace firn::kernels::FIRN_ISA
