// SPDX-License-Identifier: MIT
#include "src/app/commands.h"
#include "src/app/run_session.h"

namespace firn {

ExitCode run_command(const Options& options) {
  return run_session(options, [&](Observer& observer) {
    return Session::start(Scene::read(options.target, options.reading()), options.session, observer);
  });
}

}  // namespace firn
