// SPDX-License-Identifier: MIT
// What the program ends with, for scripts.
#pragma once
#include "firn/error.h"

namespace firn {

enum class ExitCode : int {
  ok = 0,
  failed = 1,
  usage = 2,     // command line or scene
  unstable = 3,  // the simulation blew up
  io = 4,        // files
  interrupted = 130,
};

inline ExitCode exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return ExitCode::usage;
    case ErrorCode::unstable:
      return ExitCode::unstable;
    case ErrorCode::io:
      return ExitCode::io;
    case ErrorCode::interrupted:
      return ExitCode::interrupted;
    case ErrorCode::failed:
      break;
  }
  return ExitCode::failed;
}

}  // namespace firn
