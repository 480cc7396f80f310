// SPDX-License-Identifier: MIT
#include "src/app/commands.h"
#include "src/app/run_session.h"

namespace firn {

ExitCode simulate_command(const Options& options) {
  RunKind kind;
  kind.pictures = false;
  kind.particles = true;
  kind.movie = false;
  return run_session(options, [&](Observer& observer) {
    return start_session(read_scene(options.target, options.reading()), kind, options.session, observer);
  });
}

}  // namespace firn
