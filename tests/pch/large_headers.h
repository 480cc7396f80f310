// SPDX-License-Identifier: MIT
// As src/core/pch/large_headers.h, for the tests.
#pragma once
#include "src/core/pch/large_headers.h"
#include "tests/catch.h"
