// SPDX-License-Identifier: MIT
// One writer at a time in a run folder: a file `lock` in it, locked with flock() while the writer lives, so
// that the kernel gives it back however the writer ends. The file says who holds it. Local file systems and
// NFS (Linux, version 3 with its lock service, or 4) honour the lock; where a file system has none, or hides
// the locks of other machines, the claim that stands in the file counts until it is two minutes old. A writer
// renews it every ten seconds; the clocks of the machines must agree to a minute.
#pragma once
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

namespace firn {

class RunLock {
 public:
  // Errors: io Error that names the host and the process of another writer, or if the file cannot be made.
  explicit RunLock(const std::filesystem::path& folder);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  void renew();

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::thread renewer_;
};

}  // namespace firn
