// SPDX-License-Identifier: MIT
// Frames on disk in, one movie file out. With the ffmpeg program on the PATH: movie.mp4 (H.264). Without it
// an animated WebP through libwebp, so that there always is a movie; ffmpeg is never required because a fresh
// one is 190 packages.
#pragma once
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

namespace firn {

struct MovieJob {
  std::filesystem::path frames;  // folder with 0000.png (or .ppm), 0001.png, ...
  std::string extension;         // "png" or "ppm"
  int first = 0, last = 0;       // included
  double fps = 24;
  std::filesystem::path out;  // without extension
};

// The words of the ffmpeg command for this job; never passed through a shell.
std::vector<std::string> ffmpeg_command(const MovieJob& job);

// Errors: io Error if a frame cannot be read, ffmpeg fails (with the end of what it said) or the disk is
// full; interrupted Error if `stop` is set before it is made.
std::filesystem::path make_mp4(const MovieJob& job, const std::stop_token& stop = {});
std::filesystem::path make_webp(const MovieJob& job, const std::stop_token& stop = {});

}  // namespace firn
