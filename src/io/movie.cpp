// SPDX-License-Identifier: MIT
#include "src/io/movie.h"

#include <sys/wait.h>

#include <sstream>

#include "firn/error.h"
#include "src/io/program.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

std::string plain_number(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
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

fs::path make_mp4(const MovieJob& job, const std::stop_token& stop) {
  fs::path movie = job.out.string() + ".mp4";
  const fs::path unfinished = job.out.string() + ".part.mp4";
  auto words = ffmpeg_command(job);
  words.back() = unfinished.string();
  const Outcome outcome = run_program(words, stop);
  std::error_code error;
  // From a terminal Ctrl-C reaches ffmpeg too.
  if (stop.stop_requested()) {
    fs::remove(unfinished, error);
    throw Error(ErrorCode::interrupted, movie.string(), "interrupted before the movie was made");
  }
  if (!WIFEXITED(outcome.status) || WEXITSTATUS(outcome.status) != 0) {
    fs::remove(unfinished, error);
    throw Error(ErrorCode::io, movie.string(), "ffmpeg failed: " + last_line(outcome.said));
  }
  if (fs::file_size(unfinished, error) == 0 || error) {
    fs::remove(unfinished, error);
    throw Error(ErrorCode::io, movie.string(),
                "ffmpeg ended as if all were well, but made no movie: " + last_line(outcome.said));
  }
  fs::rename(unfinished, movie, error);
  if (error) throw Error(ErrorCode::io, movie.string(), "cannot write: " + error.message());
  return movie;
}

}  // namespace firn
