// SPDX-License-Identifier: MIT
// What a call of the library is refused with.
#pragma once
#include "firn/error.h"
#include "tests/catch.h"

namespace firn::test {

// Fails the test if f() is not refused.
template <class F>
Error refusal(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return error;
  }
  FAIL("nothing was refused");
  return {ErrorCode::failed, "", ""};
}

}  // namespace firn::test
