// SPDX-License-Identifier: MIT
#include "src/app/run_session.h"

#include <iostream>
#include <string>
#include <vector>

#include "src/app/interrupt.h"
#include "src/app/progress.h"
#include "src/app/report.h"
#include "src/io/program.h"

namespace firn {
namespace {

// The command that goes on with an interrupted session.
std::string command_again(const Options& options, const Session& session, const std::vector<int>& left) {
  if (!session.shares()) return shell_line({"firn", "resume", as_operand(session.folder())});
  std::vector<std::string> words = {"firn", "render", as_operand(options.target)};
  if (options.session.overwrite) words.push_back("--overwrite");
  if (!left.empty()) {
    words.push_back("--frames");
    words.push_back(std::to_string(left.front()) + "-" + std::to_string(left.back()));
  }
  return shell_line(words);
}

}  // namespace

ExitCode run_session(const Options& options, const std::function<Session(Observer&)>& begin) {
  Progress progress(options.quiet);
  Session session = begin(progress);
  const SessionResult result = session.run(stop_of_signals());
  const std::string folder = session.folder();
  if (result.interrupted) {
    session.tell("Interrupted. " + std::to_string(result.kept) +
                 (result.kept == 1 ? " finished frame is" : " finished frames are") + " kept in " + folder +
                 ". Continue with: " + command_again(options, session, result.left));
  } else if (result.nothing_to_do) {
    session.tell("This run is complete.");
  } else {
    session.tell(closing_report(session, result.intervals, options.session.threads));
  }
  std::cout << folder << "\n";
  return result.interrupted ? ExitCode::interrupted : ExitCode::ok;
}

}  // namespace firn
