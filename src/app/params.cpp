// SPDX-License-Identifier: MIT
#include <iostream>

#include "src/app/commands.h"
#include "src/scene/scene.h"

namespace firn {

ExitCode params_command(const Options& options) {
  if (options.markdown) {
    std::cout << scene_format_markdown();
  } else {
    print_params(std::cout, options.target);
  }
  return ExitCode::ok;
}

}  // namespace firn
