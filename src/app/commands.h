// SPDX-License-Identifier: MIT
// One function a command, one file each. They return how the program ends; errors come out as exceptions.
#pragma once
#include "src/app/exit_code.h"
#include "src/app/options.h"

namespace firn {

ExitCode run_command(const Options& options);
ExitCode simulate_command(const Options& options);
ExitCode render_command(const Options& options);
ExitCode resume_command(const Options& options);
ExitCode check_command(const Options& options);
ExitCode params_command(const Options& options);
ExitCode info_command(const Options& options);

}  // namespace firn
