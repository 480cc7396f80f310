// SPDX-License-Identifier: MIT
#include "src/app/commands.h"
#include "src/app/new_run.h"

namespace firn {

ExitCode run_command(const Options& options) { return run_scene(options, {}); }

}  // namespace firn
