// SPDX-License-Identifier: MIT
#include <cstdio>

#include "src/core/isa.h"
int main() { std::puts(firn::choose_kernels("auto").isa); }
