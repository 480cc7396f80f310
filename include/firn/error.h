// SPDX-License-Identifier: MIT
// The one exception type of firn: what a person did or met, where, and of which kind it is. Whatever firn
// throws on purpose is one; memory that is not to be had comes out as std::bad_alloc. Broken invariants are
// asserts, not errors.
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

#include "firn/export.h"

namespace firn {

// Of which kind an error is, as a program decides by.
enum class ErrorCode {
  failed,       // firn's own fault
  usage,        // what was asked for: a command line, a scene, an argument
  unstable,     // the simulation blew up
  io,           // files
  interrupted,  // it was stopped on request
};

// What firn throws. Its what() is a line for people that begins with where().
class FIRN_API Error : public std::runtime_error {
 public:
  // `where` is "file:line:column", a path, or empty; `what` is one line: what is wrong, what was expected, a
  // hint.
  Error(ErrorCode code, std::string where, const std::string& what)
      : std::runtime_error(where.empty() ? what : where + ": " + what),
        code_(code),
        where_(std::move(where)) {}
  // Its kind.
  ErrorCode code() const { return code_; }
  // As it was given.
  const std::string& where() const { return where_; }

 private:
  ErrorCode code_;
  std::string where_;
};

}  // namespace firn
