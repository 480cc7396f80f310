// SPDX-License-Identifier: MIT
// Checks that something is refused with a firn::Error whose one line holds `part`. Written out here because
// the string matchers of Catch2 2 and 3 have different names.
#pragma once
#include <string>

#include "firn/error.h"
#include "tests/catch.h"

namespace firn::test {

struct Refusal {
  ErrorCode code = ErrorCode::failed;
  std::string line = "(nothing was refused)";
};

template <class Action>
Refusal refusal(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  return {};
}

}  // namespace firn::test

#define CHECK_REFUSES(expression, part)                                                        \
  do {                                                                                         \
    const std::string said = firn::test::refusal([&] { static_cast<void>(expression); }).line; \
    INFO("said: " << said);                                                                    \
    CHECK(said.find(part) != std::string::npos);                                               \
  } while (false)
