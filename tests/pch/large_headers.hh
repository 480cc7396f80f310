// SPDX-License-Identifier: MIT
// As src/core/pch/large_headers.hh, for the tests.
#include "src/core/pch/large_headers.hh"
#include "tests/catch.h"
