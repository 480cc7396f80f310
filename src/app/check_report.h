// SPDX-License-Identifier: MIT
// What `firn check` prints of a scene.
#pragma once
#include "firn/check.h"

namespace firn {

void print_check(const CheckReport& report, bool quick);  // on stdout

// On stderr; of each kind the first few one by one, and then how many there are.
void print_warnings(const CheckReport& report);

}  // namespace firn
