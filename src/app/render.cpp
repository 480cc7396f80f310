// SPDX-License-Identifier: MIT
// Pictures without a movie: of a run, or of a scene the frames asked for (the initial state if none),
// simulated on the way.
#include <filesystem>

#include "src/app/commands.h"
#include "src/app/run_session.h"

namespace firn {

ExitCode render_command(const Options& options) {
  RunKind kind;
  kind.movie = false;
  kind.frames = std::pair(0, 0);
  return run_session(options, [&](Observer& observer) {
    if (std::filesystem::is_directory(options.target))
      return render_session(options.target, options.reading(), options.session, observer);
    return start_session(read_scene(options.target, options.reading()), kind, options.session, observer);
  });
}

}  // namespace firn
