// SPDX-License-Identifier: MIT
#pragma once
namespace firn::kernels {
struct MpmKernels {};
}  // namespace firn::kernels
