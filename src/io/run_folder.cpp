// SPDX-License-Identifier: MIT
#include "src/io/run_folder.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <utility>

#include "firn/error.h"
#include "src/io/file.h"
#include "src/io/program.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

// Everything that a run writes; --overwrite removes these and nothing else.
constexpr const char* kOwnNames[] = {
    "run.json", "frames.jsonl", "scene.resolved.toml", "log.txt",   "metrics.csv", "trace.json",
    "frames",   "particles",    "checkpoints",         "movie.mp4", "movie.webp"};

constexpr const char *kLock = ".firn-lock", *kClaim = ".firn-claim";
constexpr int kTries = 20;  // to share with a process that is about to do so too
constexpr auto kPause = std::chrono::milliseconds(100);

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
  throw Error(ErrorCode::io, path.string(), "cannot write into this folder: " + reason);
}

bool present(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

std::string numbered(int frame, const std::string& extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%04d", frame);
  return name + extension;
}

fs::path absolute_of(const fs::path& path) { return fs::absolute(path).lexically_normal(); }

// Makes `path` and its missing parents and returns those it made. One mkdir a folder: of two runs that want
// the same free name only one gets it.
std::vector<fs::path> make_folders(const fs::path& path) {
  std::vector<fs::path> missing, made;
  for (fs::path p = absolute_of(path); !p.empty() && !present(p); p = p.parent_path()) {
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
  if (::access(folder.c_str(), W_OK | X_OK) != 0) fail(folder, std::strerror(errno));
}

// Whether a run gave a file of frames/, particles/ or checkpoints/ its name: "0007.png", "0007.png.part".
bool is_numbered(const fs::path& file) {
  const std::string name = file.filename();
  const std::size_t digits = name.find_first_not_of("0123456789");
  return digits != std::string::npos && digits >= 4 && name[digits] == '.';
}

// Removes what a run wrote into an inner folder, and the folder if nothing else is in it.
void empty(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> own;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_numbered(entry.path()) && !fs::is_directory(entry.symlink_status())) own.push_back(entry.path());
  }
  for (const fs::path& file : own) {
    fs::remove(file, error);
    if (error) fail(file, error.message());
  }
  fs::remove(folder, error);  // refuses if something is left
}

// Files that write_file() did not finish, and claims on frames.
void sweep(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path kind = entry.path().extension();
    if (kind == ".part" || kind == kClaim) fs::remove(entry.path(), ignored);
  }
}

// Whether this is a manifest, of whatever state and version; not any file of that name.
bool is_manifest(const fs::path& file) {
  try {
    const std::string text = read_file(file);
    return text.find("\"scene_hash\"") != std::string::npos && text.find("\"revision\"") != std::string::npos;
  } catch (const Error&) {
    return false;
  }
}

void refuse_foreign_files(const fs::path& folder, bool overwrite) {
  const std::string name = folder.string();
  if (present(folder / "run.json")) {
    if (overwrite && ::access((folder / "run.json").c_str(), R_OK) != 0)
      fail(folder / "run.json", std::strerror(errno));
    if (overwrite && is_manifest(folder / "run.json")) return;
    if (overwrite)
      throw Error(ErrorCode::usage, name,
                  "the run.json in this folder is not of a run of firn; give another --out");
    throw Error(ErrorCode::usage, name,
                "this folder holds a run; continue it with '" +
                    shell_line({"firn", "resume", as_operand(name)}) +
                    "', replace it with --overwrite, or give another --out");
  }
  for (const char* own : kOwnNames) {
    if (present(folder / own)) {
      throw Error(
          ErrorCode::usage, name,
          std::string("this folder has a '") + own + "' that no run of firn made; give another --out");
    }
  }
}

}  // namespace

RunFolder RunFolder::take(const std::string& scene, const std::optional<std::string>& out, bool overwrite) {
  RunFolder folder;
  folder.overwrite_ = overwrite;
  folder.path_ = out ? fs::path(*out) : fs::path("out") / scene;
  std::error_code error;
  if (out && present(folder.path_) && !fs::is_directory(folder.path_, error))
    fail(folder.path_, "it is not a folder");
  folder.made_ = out || !present(folder.path_) ? make_folders(folder.path_) : std::vector<fs::path>();
  // The next free name, also where another process was quicker.
  for (int n = 2; !out && (folder.made_.empty() || folder.made_.back() != absolute_of(folder.path_)); ++n) {
    folder.path_ = fs::path("out") / (scene + "-" + std::to_string(n));
    if (!present(folder.path_)) folder.made_ = make_folders(folder.path_);
  }
  probe(folder.path_);
  refuse_foreign_files(folder.path_, overwrite);
  if (present(folder.manifest())) folder.lock();  // what is to be replaced may be in the making
  return folder;
}

RunFolder RunFolder::open(const fs::path& path) {
  RunFolder folder;
  folder.path_ = path;
  folder.opened_ = true;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  const auto refuse = [&](const std::string& what) { throw Error(ErrorCode::io, path.string(), what); };
  if (status.type() == fs::file_type::not_found) refuse("no such folder");
  if (error) refuse(error.message());
  if (status.type() != fs::file_type::directory) refuse("it is not a folder, as a run is");
  if (fs::symlink_status(folder.manifest(), error).type() == fs::file_type::not_found)
    refuse("no run is in this folder (it has no run.json)");
  if (error) refuse(error.message());
  return folder;
}

RunFolder::RunFolder(RunFolder&& other) noexcept { *this = std::move(other); }

RunFolder& RunFolder::operator=(RunFolder&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(made_, other.made_);
  std::swap(overwrite_, other.overwrite_);
  std::swap(opened_, other.opened_);
  std::swap(fresh_, other.fresh_);
  std::swap(lock_, other.lock_);
  return *this;
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  if (lock_ && !lock_->is_held()) return;  // what is there now is another run's
  if (fresh_) {                            // when it was locked, none of these was there
    for (const char* own : kOwnNames) fs::remove_all(path_ / own, ignored);
  }
  lock_.reset();
  // A folder that is not empty stays.
  for (auto it = made_.rbegin(); it != made_.rend(); ++it) fs::remove(*it, ignored);
}

void RunFolder::lock() {
  if (lock_) return;
  lock_ = std::make_unique<FileLock>(path_ / kLock, FileLock::Kind::exclusive, path_);
  if (opened_) return;
  refuse_foreign_files(path_, overwrite_);  // again: another process may have been here before the lock
  fresh_ = !present(manifest());
}

bool RunFolder::lock_shared() {
  lock_ = FileLock::try_take(path_ / kLock);
  for (int tries = 1; !lock_; ++tries) {
    try {
      lock_ = std::make_unique<FileLock>(path_ / kLock, FileLock::Kind::shared, path_);
      return false;
    } catch (const Error&) {
      if (tries == kTries) throw;
      std::this_thread::sleep_for(kPause);
    }
  }
  return true;
}

void RunFolder::share_with_others() { lock_->share(); }

std::unique_ptr<FileLock> RunFolder::claim(int frame) const {
  return FileLock::try_take(frames() / numbered(frame, kClaim));
}

void RunFolder::clear() {
  std::error_code error;
  for (const char* own : kOwnNames) {
    if (path_ / own == manifest()) continue;
    if (fs::is_directory(fs::symlink_status(path_ / own, error))) {
      empty(path_ / own);
    } else {
      fs::remove(path_ / own, error);
      if (error) fail(path_ / own, error.message());
    }
  }
}

void RunFolder::require_outside(const fs::path& file) const {
  std::error_code ignored;
  if (opened_ || !present(manifest())) return;
  const fs::path within =
      fs::weakly_canonical(file, ignored).lexically_relative(fs::canonical(path_, ignored));
  if (within.empty() || *within.begin() == "..") return;
  if (std::find(std::begin(kOwnNames), std::end(kOwnNames), within.begin()->string()) == std::end(kOwnNames))
    return;
  throw Error(ErrorCode::usage, file.string(),
              "the scene reads this file, which --overwrite would remove: move it");
}

void RunFolder::begin() {
  std::error_code error;
  for (const char* inner : {"frames", "particles", "checkpoints"}) {
    fs::create_directory(path_ / inner, error);
    if (error) fail(path_ / inner, error.message());
  }
  for (const fs::path& folder : {frames(), particles(), checkpoints()}) sweep(folder);
  for (const char* own : kOwnNames) fs::remove(path_ / (std::string(own) + ".part"), error);
  for (const char* movie : {"movie.part.mp4", "movie.part.webp"}) fs::remove(path_ / movie, error);
}

void RunFolder::require_lock() const {
  if (lock_ && lock_->is_held()) return;
  throw Error(ErrorCode::io, path_.string(),
              "this folder was moved or removed, or another process has taken the run over");
}

void RunFolder::keep() {
  made_.clear();
  fresh_ = false;
}

fs::path RunFolder::frame(int number, const std::string& extension) const {
  return frames() / numbered(number, "." + extension);
}

fs::path RunFolder::particle_file(int number) const { return particles() / numbered(number, ".firn"); }

fs::path RunFolder::checkpoint(int number) const { return checkpoints() / numbered(number, ".checkpoint"); }

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
