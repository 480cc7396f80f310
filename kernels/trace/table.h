// SPDX-License-Identifier: MIT
#pragma once
namespace firn::kernels {
struct TraceKernels {};
}  // namespace firn::kernels
