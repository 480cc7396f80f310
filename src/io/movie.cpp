// SPDX-License-Identifier: MIT
// The ffmpeg program as a child process: arguments as a vector, its complaints through a pipe.
#include "src/io/movie.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "src/core/error.h"

extern char** environ;

namespace firn {
namespace {

namespace fs = std::filesystem;

constexpr int kLookMilliseconds = 100;  // between two looks at the flag that stops
constexpr int kLooks = 20;              // at a program that was asked to end

std::string plain_number(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
}

struct Outcome {
  int status = -1;
  std::string said;  // stdout and stderr, the last part
};

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

// The last part of what a program says until it ends, or is ended because of `stop`.
std::string listen(int pipe, pid_t child, const std::atomic<bool>& stop) {
  std::string said;
  char buffer[4096];
  while (!stop) {
    pollfd waiting{pipe, POLLIN, 0};
    if (::poll(&waiting, 1, kLookMilliseconds) <= 0) continue;
    const ssize_t count = ::read(pipe, buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return said;
    said.append(buffer, static_cast<std::size_t>(count));
    if (said.size() > 8192) said.erase(0, said.size() - 4096);
  }
  end_program(child);
  return said;
}

// Runs the words to their end, or ends the program when `stop` is set; nothing on stdin.
Outcome run_program(std::vector<std::string> words, const std::atomic<bool>& stop) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Outcome outcome;
  if (failed == 0) {
    outcome.said = listen(ends[0], child, stop);
    while (::waitpid(child, &outcome.status, 0) < 0 && errno == EINTR) {
    }
  }
  ::close(ends[0]);
  return outcome;
}

// Of a program that may write anything: without control characters.
std::string printable(std::string text) {
  std::erase_if(text, [](unsigned char c) { return c < ' ' || c == 0x7F; });
  return text;
}

std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of(" \r\n");
  if (end == std::string::npos) return "it said nothing";
  const auto begin = text.find_last_of("\r\n", end);
  return printable(text.substr(begin == std::string::npos ? 0 : begin + 1,
                               end - (begin == std::string::npos ? 0 : begin + 1) + 1));
}

// An absolute path is never taken for a protocol or an option. A per cent sign of its own is doubled.
std::string pattern_of(const MovieJob& job) {
  std::string pattern;
  for (const char c : fs::absolute(job.frames).string()) pattern += c == '%' ? "%%" : std::string(1, c);
  return pattern + "/%04d." + job.extension;
}

}  // namespace

std::vector<std::string> ffmpeg_command(const MovieJob& job) {
  // yuv420p plays everywhere and wants even sizes: odd ones are padded by one pixel.
  return {"ffmpeg",
          "-y",
          "-loglevel",
          "error",
          "-framerate",
          plain_number(job.fps),
          "-start_number",
          std::to_string(job.first),
          "-i",
          pattern_of(job),
          "-frames:v",
          std::to_string(job.last - job.first + 1),
          "-vf",
          "pad=ceil(iw/2)*2:ceil(ih/2)*2",
          "-c:v",
          "libx264",
          "-crf",
          "17",
          "-pix_fmt",
          "yuv420p",
          "-movflags",
          "+faststart",
          fs::absolute(job.out).string() + ".mp4"};
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

fs::path make_mp4(const MovieJob& job, const std::atomic<bool>& stop) {
  const fs::path movie = job.out.string() + ".mp4";
  const fs::path unfinished = job.out.string() + ".part.mp4";
  auto words = ffmpeg_command(job);
  words.back() = unfinished.string();
  const Outcome outcome = run_program(words, stop);
  std::error_code error;
  // From a terminal Ctrl-C reaches ffmpeg too.
  if (stop) {
    fs::remove(unfinished, error);
    throw Error(ExitCode::interrupted, movie.string(), "interrupted before the movie was made");
  }
  if (!WIFEXITED(outcome.status) || WEXITSTATUS(outcome.status) != 0) {
    fs::remove(unfinished, error);
    throw Error(ExitCode::io, movie.string(), "ffmpeg failed: " + last_line(outcome.said));
  }
  fs::rename(unfinished, movie, error);
  if (error) throw Error(ExitCode::io, movie.string(), "cannot write: " + error.message());
  return movie;
}

}  // namespace firn
