// SPDX-License-Identifier: MIT
// The ffmpeg program as a child process: arguments as a vector, its complaints through a pipe.
#include "src/io/movie.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "src/core/error.h"

extern char** environ;

namespace firn {
namespace {

namespace fs = std::filesystem;

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

// Runs the words to their end; nothing on stdin.
Outcome run_program(std::vector<std::string> words) {
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
    char buffer[4096];
    for (ssize_t count; (count = ::read(ends[0], buffer, sizeof buffer)) > 0;) {
      outcome.said.append(buffer, static_cast<std::size_t>(count));
      if (outcome.said.size() > 8192) outcome.said.erase(0, outcome.said.size() - 4096);
    }
    ::waitpid(child, &outcome.status, 0);
  }
  ::close(ends[0]);
  return outcome;
}

std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of(" \r\n");
  if (end == std::string::npos) return "it said nothing";
  const auto begin = text.find_last_of("\r\n", end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
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
          (job.frames / ("%04d." + job.extension)).string(),
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
          job.out.string() + ".mp4"};
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

fs::path make_mp4(const MovieJob& job) {
  const fs::path movie = job.out.string() + ".mp4";
  const fs::path unfinished = job.out.string() + ".part.mp4";
  auto words = ffmpeg_command(job);
  words.back() = unfinished.string();
  const Outcome outcome = run_program(words);
  std::error_code error;
  if (!WIFEXITED(outcome.status) || WEXITSTATUS(outcome.status) != 0) {
    fs::remove(unfinished, error);
    throw Error(ExitCode::io, movie.string(), "ffmpeg failed: " + last_line(outcome.said));
  }
  fs::rename(unfinished, movie, error);
  if (error) throw Error(ExitCode::io, movie.string(), "cannot write: " + error.message());
  return movie;
}

}  // namespace firn
