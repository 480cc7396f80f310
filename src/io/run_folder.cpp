// SPDX-License-Identifier: MIT
#include "src/io/run_folder.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "src/core/error.h"
#include "src/io/file.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

// Everything that a run writes; --overwrite removes these and nothing else.
constexpr const char* kOwnNames[] = {
    "run.json", "scene.resolved.toml", "log.txt",     "metrics.csv", "trace.json",
    "frames",   "particles",           "checkpoints", "movie.mp4",   "movie.webp"};

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
  throw Error(ExitCode::io, path.string(), "cannot write into this folder: " + reason);
}

bool present(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

// Makes `path` and its missing parents and returns those it made. One mkdir a folder: of two runs that want
// the same free name only one gets it.
std::vector<fs::path> make_folders(const fs::path& path) {
  std::vector<fs::path> missing, made;
  for (fs::path p = fs::absolute(path).lexically_normal(); !p.empty() && !present(p); p = p.parent_path()) {
    if (p.has_filename()) missing.insert(missing.begin(), p);
  }
  for (const auto& p : missing) {
    std::error_code error;
    if (fs::create_directory(p, error)) made.push_back(p);
    if (error) {
      const std::string reason = error.message();
      for (auto it = made.rbegin(); it != made.rend(); ++it) fs::remove(*it, error);
      fail(path, reason);
    }
  }
  return made;
}

void probe(const fs::path& folder) {
  const fs::path file = folder / ".firn-probe";
  std::FILE* probe = std::fopen(file.c_str(), "wb");
  if (!probe) fail(folder, std::strerror(errno));
  std::fclose(probe);
  std::error_code ignored;
  fs::remove(file, ignored);
}

// Files that a killed process did not finish: x.part of write_file(), movie.part.mp4 of ffmpeg.
void sweep(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path name = entry.path().filename();
    if (name.extension() == ".part" || name.stem() == "movie.part") fs::remove(entry.path(), ignored);
  }
}

void refuse_foreign_files(const fs::path& folder, bool overwrite) {
  const std::string name = folder.string();
  if (present(folder / "run.json")) {
    if (overwrite) return;
    throw Error(ExitCode::usage, name,
                "this folder holds a run; continue it with 'firn resume " + name +
                    "', replace it with --overwrite, or give another --out");
  }
  for (const char* own : kOwnNames) {
    if (present(folder / own)) {
      throw Error(
          ExitCode::usage, name,
          std::string("this folder has a '") + own + "' that no run of firn made; give another --out");
    }
  }
}

}  // namespace

RunFolder RunFolder::take(const std::string& scene, const std::optional<std::string>& out, bool overwrite) {
  RunFolder folder;
  folder.overwrite_ = overwrite;
  folder.path_ = out ? fs::path(*out) : fs::path("out") / scene;
  if (!out) {
    for (int n = 2; present(folder.path_); ++n)
      folder.path_ = fs::path("out") / (scene + "-" + std::to_string(n));
  }
  std::error_code error;
  if (present(folder.path_) && !fs::is_directory(folder.path_, error)) fail(folder.path_, "it is a file");
  folder.made_ = make_folders(folder.path_);
  probe(folder.path_);
  refuse_foreign_files(folder.path_, overwrite);
  if (present(folder.manifest())) folder.lock();  // what is to be replaced may be in the making
  return folder;
}

RunFolder RunFolder::open(const fs::path& path) {
  RunFolder folder;
  folder.path_ = path;
  folder.opened_ = true;
  if (!present(folder.manifest())) {
    throw Error(ExitCode::io, path.string(), "no run is in this folder (it has no run.json)");
  }
  return folder;
}

RunFolder::RunFolder(RunFolder&& other) noexcept { *this = std::move(other); }

RunFolder& RunFolder::operator=(RunFolder&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(made_, other.made_);
  std::swap(overwrite_, other.overwrite_);
  std::swap(opened_, other.opened_);
  std::swap(begun_, other.begun_);
  std::swap(lock_, other.lock_);
  return *this;
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  if (begun_) {  // when it began, none of these was there
    for (const char* own : kOwnNames) fs::remove_all(path_ / own, ignored);
  }
  lock_.reset();
  // A folder that is not empty stays.
  for (auto it = made_.rbegin(); it != made_.rend(); ++it) fs::remove(*it, ignored);
}

void RunFolder::lock() {
  if (!lock_) lock_ = std::make_unique<RunLock>(path_);
}

void RunFolder::begin() {
  lock();
  std::error_code error;
  if (!opened_) {
    refuse_foreign_files(path_, overwrite_);  // again: another process may have been here before the lock
    for (const char* own : kOwnNames) {
      fs::remove_all(path_ / own, error);
      if (error) fail(path_ / own, error.message());
    }
    begun_ = true;
  }
  for (const char* inner : {"frames", "particles", "checkpoints"}) {
    fs::create_directory(path_ / inner, error);
    if (error) fail(path_ / inner, error.message());
  }
  for (const fs::path& folder : {path_, frames(), particles(), checkpoints()}) sweep(folder);
}

void RunFolder::keep() {
  made_.clear();
  begun_ = false;
}

fs::path RunFolder::frame(int number, const std::string& extension) const {
  char name[32];
  std::snprintf(name, sizeof name, "%04d.", number);
  return frames() / (name + extension);
}

fs::path RunFolder::particle_file(int number) const {
  char name[32];
  std::snprintf(name, sizeof name, "%04d.firn", number);
  return particles() / name;
}

fs::path RunFolder::checkpoint(int number) const {
  char name[32];
  std::snprintf(name, sizeof name, "%04d.checkpoint", number);
  return checkpoints() / name;
}

std::vector<int> RunFolder::saved_checkpoints() const {
  std::vector<int> frames;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(checkpoints(), ignored)) {
    const int frame = std::atoi(entry.path().stem().c_str());
    if (checkpoint(frame).filename() == entry.path().filename()) frames.push_back(frame);
  }
  std::sort(frames.rbegin(), frames.rend());
  return frames;
}

}  // namespace firn
