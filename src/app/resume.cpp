// SPDX-License-Identifier: MIT
#include "src/app/commands.h"
#include "src/app/run_session.h"

namespace firn {

ExitCode resume_command(const Options& options) {
  return run_session(options, [&](Observer& observer) {
    return Session::resume(options.target, options.session, observer);
  });
}

}  // namespace firn
