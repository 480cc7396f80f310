// SPDX-License-Identifier: MIT
// Pictures without a movie: of a run, or of a scene the frames asked for (the initial state if none),
// simulated on the way.
#include <filesystem>

#include "src/app/commands.h"
#include "src/app/run_session.h"

namespace firn {

ExitCode render_command(const Options& options) {
  SessionOptions session = options.session;
  session.movie = false;
  return run_session(options, [&](Observer& observer) {
    if (std::filesystem::is_directory(options.target))
      return Session::render(options.target, session, options.reading(), observer);
    if (!session.frames) session.frames = std::pair(0, 0);
    return Session::start(Scene::read(options.target, options.reading()), session, observer);
  });
}

}  // namespace firn
