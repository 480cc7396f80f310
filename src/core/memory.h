// SPDX-License-Identifier: MIT
#pragma once
#include <cstdint>

namespace firn {

std::uint64_t machine_memory();  // bytes, of the whole machine

}  // namespace firn
