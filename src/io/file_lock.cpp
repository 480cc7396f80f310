// SPDX-License-Identifier: MIT
#include "src/io/file_lock.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <sstream>
#include <string_view>

#include "firn/error.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

constexpr auto kRenew = std::chrono::seconds(10);
constexpr long kExpires = 120;  // s
constexpr const char* kShared = "shared";

[[noreturn]] void cannot_write(const fs::path& path, int error) {
  throw Error(ErrorCode::io, path.parent_path().string(),
              std::string("cannot write into this folder: ") + std::strerror(error));
}

std::string host_name() {
  char name[HOST_NAME_MAX + 1] = {};
  return ::gethostname(name, sizeof name - 1) == 0 && *name ? name : "unknown";
}

struct Claim {
  std::string host;
  long process = 0;
  FileLock::Kind kind = FileLock::Kind::exclusive;
  long age = 0;  // s since it was renewed
};

Claim read_claim(int descriptor) {
  char text[512] = {};
  Claim claim;
  std::string kind;
  if (::pread(descriptor, text, sizeof text - 1, 0) > 0) {
    const std::string_view line = text;  // what is left of a longer one may follow
    std::istringstream(std::string(line.substr(0, line.find('\n')))) >> claim.host >> claim.process >> kind;
  }
  if (kind == kShared) claim.kind = FileLock::Kind::shared;
  struct stat status {};
  if (::fstat(descriptor, &status) == 0) claim.age = std::time(nullptr) - status.st_mtime;
  return claim;
}

[[noreturn]] void refuse(const fs::path& where, const Claim& claim) {
  std::string hint;
  if (!claim.host.empty() && claim.host != host_name()) {
    hint = ", by a claim that is " + std::to_string(std::max(claim.age, 0L)) +
           " s old; if that process is gone, try again in " +
           std::to_string(std::max(kExpires - std::max(claim.age, 0L), 0L)) + " s";
  }
  // Of several that share, the one that the claim names may have ended.
  const bool is_gone =
      claim.host == host_name() && ::kill(static_cast<pid_t>(claim.process), 0) != 0 && errno == ESRCH;
  throw Error(ErrorCode::io, where.string(),
              "this run is being written by " +
                  (is_gone ? "another process" : "process " + std::to_string(claim.process)) + " on " +
                  (claim.host.empty() ? "this machine" : claim.host) + hint);
}

// Whether the name still leads to the opened file: its last holder may have removed it in between.
bool is_current(int descriptor, const fs::path& path) {
  struct stat opened {
  }, named{};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

// Locks it unless another has it. On a file system without locks nobody has.
bool is_taken(int descriptor, FileLock::Kind kind) {
  return ::flock(descriptor, (kind == FileLock::Kind::shared ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0 &&
         errno == EWOULDBLOCK;
}

// Of a machine whose locks may not be seen here.
bool bars(const Claim& claim, FileLock::Kind kind) {
  if (claim.host.empty() || claim.host == host_name() || std::abs(claim.age) >= kExpires) return false;
  return kind == FileLock::Kind::exclusive || claim.kind == FileLock::Kind::exclusive;
}

// The opened file, locked, or -1 and whose it is.
int acquire(const fs::path& path, FileLock::Kind kind, Claim& other) {
  for (;;) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
    if (descriptor < 0) cannot_write(path, errno);
    struct stat status {};
    if (::fstat(descriptor, &status) == 0 && !S_ISREG(status.st_mode)) {
      ::close(descriptor);
      throw Error(ErrorCode::io, path.string(), "cannot be locked: it is not a file");
    }
    const bool taken = is_taken(descriptor, kind);
    other = read_claim(descriptor);
    if (!taken && is_current(descriptor, path) && !bars(other, kind)) return descriptor;
    const bool gone = !taken && !is_current(descriptor, path);
    ::close(descriptor);
    if (!gone) return -1;
  }
}

int acquire_or_refuse(const fs::path& path, FileLock::Kind kind, const fs::path& where) {
  Claim other;
  const int descriptor = acquire(path, kind, other);
  if (descriptor < 0) refuse(where, other);
  return descriptor;
}

}  // namespace

FileLock::FileLock(fs::path path, Kind kind, int descriptor)
    : path_(std::move(path)), kind_(kind), descriptor_(descriptor) {
  if (const int error = write_claim(); error != 0) {
    if (!is_taken(descriptor_, Kind::exclusive)) ::unlink(path_.c_str());
    ::close(descriptor_);
    cannot_write(path_, error);
  }
  renewer_ = std::thread([this] { renew(); });
}

FileLock::FileLock(const fs::path& path, Kind kind, const fs::path& where)
    : FileLock(path, kind, acquire_or_refuse(path, kind, where)) {}

std::unique_ptr<FileLock> FileLock::try_take(const fs::path& path) {
  Claim other;
  const int descriptor = acquire(path, Kind::exclusive, other);
  return descriptor < 0 ? nullptr
                        : std::unique_ptr<FileLock>(new FileLock(path, Kind::exclusive, descriptor));
}

// In one write, and without a moment in which the file is empty: others read it.
int FileLock::write_claim() const {
  std::string mine = host_name() + " " + std::to_string(::getpid());
  if (kind_ == Kind::shared) mine += std::string(" ") + kShared;
  mine += "\n";
  return ::pwrite(descriptor_, mine.data(), mine.size(), 0) == static_cast<ssize_t>(mine.size()) ? 0 : errno;
}

// The last of several holders removes the file: only it can have the file for itself.
FileLock::~FileLock() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_all();
  renewer_.join();
  if (stands() && !is_taken(descriptor_, Kind::exclusive)) ::unlink(path_.c_str());
  ::close(descriptor_);
}

void FileLock::share() {
  if (is_taken(descriptor_, Kind::shared)) refuse(path_.parent_path(), read_claim(descriptor_));
  kind_ = Kind::shared;
  if (const int error = write_claim(); error != 0) cannot_write(path_, error);
}

void FileLock::renew() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kRenew, [this] { return ends_; })) {
    if (!stands()) held_ = false;
    if (held_ && kind_ == Kind::shared) write_claim();  // the one that it names may have ended
    if (held_) ::futimens(descriptor_, nullptr);
  }
}

// Whether the file is as its holders left it. Of a shared one the claim is that of the latest to come.
bool FileLock::stands() const {
  const Claim claim = read_claim(descriptor_);
  if (!is_current(descriptor_, path_)) return false;
  if (kind_ == Kind::shared) return claim.host.empty() || claim.kind == Kind::shared;
  return claim.host == host_name() && claim.process == ::getpid();
}

}  // namespace firn
