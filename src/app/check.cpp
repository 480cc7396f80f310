// SPDX-License-Identifier: MIT
// What a scene will take and show: numbers on stdout, warnings on stderr.
#include "firn/check.h"

#include "src/app/check_report.h"
#include "src/app/commands.h"

namespace firn {

ExitCode check_command(const Options& options) {
  const Scene scene = Scene::read(options.target, options.reading());
  const SessionOptions& session = options.session;
  const CheckReport report = check_scene(scene, {session.threads, session.isa, session.force});
  print_check(report, options.quick);
  print_warnings(report);
  if (report.blow_up) throw Error(*report.blow_up);
  return ExitCode::ok;
}

}  // namespace firn
