// SPDX-License-Identifier: MIT
#include "src/app/commands.h"
#include "src/app/run_session.h"

namespace firn {

ExitCode simulate_command(const Options& options) {
  SessionOptions session = options.session;
  session.pictures = false;
  session.particles = true;
  session.movie = false;
  return run_session(options, [&](Observer& observer) {
    return Session::start(Scene::read(options.target, options.reading()), session, observer);
  });
}

}  // namespace firn
