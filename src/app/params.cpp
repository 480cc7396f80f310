// SPDX-License-Identifier: MIT
#include <iostream>

#include "src/app/commands.h"
#include "src/scene/scene.h"

namespace firn {

ExitCode params_command(const Options& options) {
  print_params(std::cout, options.target);
  return ExitCode::ok;
}

}  // namespace firn
