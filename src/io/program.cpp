// SPDX-License-Identifier: MIT
#include "src/io/program.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

extern char** environ;

namespace firn {
namespace {

namespace fs = std::filesystem;

constexpr int kLookMilliseconds = 100;  // between two looks at the flag that stops
constexpr int kLooks = 20;              // at a program that was asked to end
constexpr int kPieces = 64;             // of what it says, read at once

// Asks a program to end, and kills it if it does not.
void end_program(pid_t child) {
  ::kill(child, SIGTERM);
  for (int look = 0; look < kLooks; ++look) {
    siginfo_t ended{};
    if (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        ended.si_pid == child)
      return;
    ::poll(nullptr, 0, kLookMilliseconds);
  }
  ::kill(child, SIGKILL);
}

// Adds what is in the pipe now, and forgets the beginning of much; false at its end.
bool read_what_is_there(int pipe, std::string& said) {
  char buffer[4096];
  ssize_t count = 0;
  for (int pieces = 0; pieces < kPieces && (count = ::read(pipe, buffer, sizeof buffer)) > 0; ++pieces) {
    said.append(buffer, static_cast<std::size_t>(count));
    if (said.size() > 8192) said.erase(0, said.size() - 4096);
  }
  return count != 0;
}

// What becomes of a program until it ends, whoever else holds its pipe by then, or is ended because of
// `stop`.
Outcome follow(int pipe, pid_t child, const std::stop_token& stop) {
  Outcome outcome;
  ::fcntl(pipe, F_SETFL, O_NONBLOCK);
  for (bool open = true, ended = false; !ended;) {
    pollfd waiting{pipe, POLLIN, 0};
    ::poll(&waiting, open ? 1 : 0, kLookMilliseconds);
    if (stop.stop_requested()) end_program(child);
    const pid_t waited = ::waitpid(child, &outcome.status, stop.stop_requested() ? 0 : WNOHANG);
    ended = waited != 0 && !(waited < 0 && errno == EINTR);
    open = open && read_what_is_there(pipe, outcome.said);
  }
  return outcome;
}

}  // namespace

Outcome run_program(std::vector<std::string> words, const std::stop_token& stop) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Outcome outcome;
  if (failed == 0) {
    outcome = follow(ends[0], child, stop);
  } else {
    outcome.said = std::strerror(failed);
  }
  ::close(ends[0]);
  return outcome;
}

std::string shell_line(const std::vector<std::string>& words) {
  std::string line;
  for (const auto& word : words) {
    if (!line.empty()) line += ' ';
    if (word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_+:./%=,@") ==
        std::string::npos) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

std::string as_operand(const std::string& path) { return path.starts_with('-') ? "./" + path : path; }

std::optional<fs::path> find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path candidate = fs::path(folder.empty() ? "." : folder) / name;
    std::error_code ignored;
    if (fs::is_regular_file(candidate, ignored) && ::access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return std::nullopt;
}

}  // namespace firn
