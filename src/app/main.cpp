// SPDX-License-Identifier: MIT
// Command line in, exit code out. The one place where errors are caught: one line on stderr and the code of
// the kind.
#include <fcntl.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "src/app/commands.h"
#include "src/app/interrupt.h"
#include "src/core/text.h"

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
  // The program is alone in its process: no command has more threads, and a session has even more than the
  // machine.
  std::optional<tbb::global_control> limit;
  if (options->session.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism,
                  static_cast<std::size_t>(options->session.threads));
  }
  for (const auto& [name, command] : kCommands) {
    if (options->command == name) return command(*options);
  }
  throw Error(ErrorCode::usage, "", "no command given");
}

// "scene.toml:12:3: what is wrong" as editors like it; "firn: what is wrong" where there is no place to name.
ExitCode complain(ExitCode code, const std::string& what, const std::string& where = "") {
  std::fprintf(stderr, "%s%s\n", where.empty() ? "firn: " : "", escape_control(what).c_str());
  return code;
}

// The library calls its options by their names in SessionOptions, people by those of the command line.
std::string in_words_of_people(const Error& error) {
  for (const char* option : {"frames", "isa", "quick"}) {
    if (error.where() == option) return std::string("--") + error.what();
  }
  return error.what();
}

ExitCode guarded(int count, char** words) {
  try {
    return execute(count, words);
  } catch (const Error& error) {
    return complain(exit_code(error.code()), in_words_of_people(error), error.where());
  } catch (const std::bad_alloc&) {
    return complain(ExitCode::failed, "out of memory; 'firn check SCENE' prints what a scene needs");
  } catch (const std::filesystem::filesystem_error& error) {
    return complain(ExitCode::io, error.what());
  } catch (const std::exception& error) {
    return complain(ExitCode::failed, error.what());
  }
}

// A file that is opened later must not get the number of a stream that was closed at the start: what is said
// would land in it.
void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) != -1) continue;
    if (const int opened = ::open("/dev/null", O_RDWR); opened >= 0 && opened != stream) ::close(opened);
  }
}

bool flush_output() {
  errno = 0;
  return static_cast<bool>(std::cout.flush()) && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
}

}  // namespace
}  // namespace firn

int main(int count, char** words) {
  firn::catch_signals();
  firn::open_standard_streams();
  firn::ExitCode code = firn::guarded(count, words);
  if (!firn::flush_output() && code == firn::ExitCode::ok) {
    const std::string reason =
        errno != 0 ? std::string(": ") + std::strerror(errno) : "";  // it may be long ago
    code = firn::complain(firn::ExitCode::io, "cannot write to the standard output" + reason);
  }
  return static_cast<int>(code);
}
