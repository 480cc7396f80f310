// SPDX-License-Identifier: MIT
#include "src/io/run_lock.h"

#include <fcntl.h>
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

#include "src/core/error.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

constexpr auto kRenew = std::chrono::seconds(10);
constexpr long kExpires = 120;  // s

[[noreturn]] void cannot_write(const fs::path& folder, int error) {
  throw Error(ExitCode::io, folder.string(),
              std::string("cannot write into this folder: ") + std::strerror(error));
}

std::string host_name() {
  char name[HOST_NAME_MAX + 1] = {};
  return ::gethostname(name, sizeof name - 1) == 0 && *name ? name : "unknown";
}

struct Claim {
  std::string host;
  long process = 0;
  long age = 0;  // s since it was renewed
};

Claim read_claim(int descriptor) {
  char text[512] = {};
  Claim claim;
  if (::pread(descriptor, text, sizeof text - 1, 0) > 0)
    std::istringstream(text) >> claim.host >> claim.process;
  struct stat status {};
  if (::fstat(descriptor, &status) == 0) claim.age = std::time(nullptr) - status.st_mtime;
  return claim;
}

[[noreturn]] void refuse(const fs::path& path, const Claim& claim, const std::string& hint) {
  throw Error(ExitCode::io, path.parent_path().string(),
              "this run is being written by process " + std::to_string(claim.process) + " on " +
                  (claim.host.empty() ? "this machine" : claim.host) + hint);
}

// Whether the name still leads to the opened file: its last holder may have removed it in between.
bool is_current(int descriptor, const fs::path& path) {
  struct stat opened {
  }, named{};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

// An opened file that no other process of this machine has locked.
int acquire(const fs::path& path) {
  for (;;) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (descriptor < 0) cannot_write(path.parent_path(), errno);
    const bool locked = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
    const bool taken = !locked && errno == EWOULDBLOCK;
    if (!taken && is_current(descriptor, path)) return descriptor;
    const Claim claim = read_claim(descriptor);
    ::close(descriptor);
    if (taken) refuse(path, claim, "");
  }
}

}  // namespace

RunLock::RunLock(const fs::path& folder) : path_(folder / ".firn-lock"), descriptor_(acquire(path_)) {
  const Claim claim = read_claim(descriptor_);
  if (!claim.host.empty() && claim.host != host_name() && std::abs(claim.age) < kExpires) {
    ::close(descriptor_);
    refuse(path_, claim,
           ", by a claim that is " + std::to_string(std::max(claim.age, 0L)) +
               " s old; if that process is gone, try again in " +
               std::to_string(kExpires - std::max(claim.age, 0L)) + " s");
  }
  const std::string mine = host_name() + " " + std::to_string(::getpid()) + "\n";
  if (::ftruncate(descriptor_, 0) != 0 ||
      ::pwrite(descriptor_, mine.data(), mine.size(), 0) != static_cast<ssize_t>(mine.size())) {
    const int error = errno;
    ::unlink(path_.c_str());
    ::close(descriptor_);
    cannot_write(folder, error);
  }
  renewer_ = std::thread([this] { renew(); });
}

RunLock::~RunLock() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_all();
  renewer_.join();
  if (is_mine()) ::unlink(path_.c_str());
  ::close(descriptor_);
}

void RunLock::renew() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, kRenew, [this] { return ends_; })) {
    if (!is_mine()) held_ = false;
    if (held_) ::futimens(descriptor_, nullptr);
  }
}

bool RunLock::is_mine() const {
  const Claim claim = read_claim(descriptor_);
  return is_current(descriptor_, path_) && claim.host == host_name() && claim.process == ::getpid();
}

}  // namespace firn
