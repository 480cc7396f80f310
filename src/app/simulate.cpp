// SPDX-License-Identifier: MIT
#include "src/app/commands.h"
#include "src/app/new_run.h"

namespace firn {

ExitCode simulate_command(const Options& options) {
  RunKind kind;
  kind.pictures = false;
  kind.particles = true;
  kind.movie = false;
  return run_scene(options, kind);
}

}  // namespace firn
