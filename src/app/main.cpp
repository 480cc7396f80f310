// SPDX-License-Identifier: MIT
// Command line in, exit code out. The one place where errors are caught: one line on stderr and the code of
// the kind.
#include <tbb/global_control.h>

#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "src/app/commands.h"
#include "src/app/interrupt.h"

namespace firn {
namespace {

constexpr std::pair<const char*, ExitCode (*)(const Options&)> kCommands[] = {
    {"run", run_command},       {"simulate", simulate_command}, {"render", render_command},
    {"resume", resume_command}, {"check", check_command},       {"params", params_command},
    {"info", info_command},
};

ExitCode execute(int count, char** words) {
  const std::optional<Options> options = parse_options(count, words);
  if (!options) return ExitCode::ok;
  // Holds for what happens before the flow graph too: placing particles, the first sort, the movie.
  std::optional<tbb::global_control> limit;
  if (options->threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options->threads));
  }
  for (const auto& [name, command] : kCommands) {
    if (options->command == name) return command(*options);
  }
  throw Error(ExitCode::usage, "", "no command given");
}

// "scene.toml:12:3: what is wrong" as editors like it; "firn: what is wrong" where there is no place to name.
ExitCode complain(ExitCode code, const std::string& what, const std::string& where = "") {
  std::fprintf(stderr, "%s%s\n", where.empty() ? "firn: " : "", what.c_str());
  return code;
}

ExitCode guarded(int count, char** words) {
  try {
    return execute(count, words);
  } catch (const Error& error) {
    return complain(error.code(), error.what(), error.where());
  } catch (const std::bad_alloc&) {
    return complain(ExitCode::failed, "out of memory; 'firn check SCENE' prints what a scene needs");
  } catch (const std::exception& error) {
    return complain(ExitCode::failed, error.what());
  }
}

}  // namespace
}  // namespace firn

int main(int count, char** words) {
  firn::catch_signals();
  const firn::ExitCode code = firn::guarded(count, words);
  std::cout.flush();
  return static_cast<int>(code);
}
