// SPDX-License-Identifier: MIT
// Chooses the kernels' instruction set once, at start.
#pragma once
#include <string>
#include <vector>

#include "kernels/table.h"

namespace firn {

// The tables of this build that this CPU can run, best last.
std::vector<const kernels::KernelTable*> supported_kernels();

// `name` is "auto" (the best one), "base", "x86-64-v3" or "x86-64-v4"; an unknown or unsupported one is a
// usage Error.
const kernels::KernelTable& choose_kernels(const std::string& name);

}  // namespace firn
