// SPDX-License-Identifier: MIT
// A session from its beginning to its end, for a person: progress on stderr, the folder on stdout.
#pragma once
#include <functional>

#include "firn/session.h"
#include "src/app/exit_code.h"
#include "src/app/options.h"

namespace firn {

ExitCode run_session(const Options& options, const std::function<Session(Observer&)>& begin);

}  // namespace firn
