// SPDX-License-Identifier: MIT
// Compiled once per instruction set: gathers that build's kernels into its table.
#include "kernels/table.h"

namespace firn::kernels::FIRN_ISA {

#if defined(__AVX512F__)
constexpr const char* kIsaName = "x86-64-v4";
#elif defined(__AVX2__)
constexpr const char* kIsaName = "x86-64-v3";
#else
constexpr const char* kIsaName = "base";
#endif

MpmKernels mpm_kernels();      // kernels/mpm/table.cpp
TraceKernels trace_kernels();  // kernels/trace/table.cpp
ShadeKernels shade_kernels();  // kernels/shade/table.cpp

const KernelTable& table() {
  static const KernelTable kTable{kIsaName, mpm_kernels(), trace_kernels(), shade_kernels()};
  return kTable;
}

}  // namespace firn::kernels::FIRN_ISA
