// SPDX-License-Identifier: MIT
// The one exception type of firn: what a person did or met, where, and the exit code it ends in.
// Thrown anywhere in src/, caught once in main. Broken invariants are asserts, not errors.
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

namespace firn {

enum class ExitCode : int {
  ok = 0,
  failed = 1,
  usage = 2,     // command line or scene
  unstable = 3,  // the simulation blew up
  io = 4,        // files
  interrupted = 130,
};

class Error : public std::runtime_error {
 public:
  // `where` is "file:line:column", a path, or empty; `what` is one line: what is wrong, what was expected, a
  // hint.
  Error(ExitCode code, std::string where, const std::string& what)
      : std::runtime_error(where.empty() ? what : where + ": " + what),
        code_(code),
        where_(std::move(where)) {}
  ExitCode code() const { return code_; }
  const std::string& where() const { return where_; }

 private:
  ExitCode code_;
  std::string where_;
};

}  // namespace firn
