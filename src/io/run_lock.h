// SPDX-License-Identifier: MIT
// One writer at a time in a run folder: a file `.firn-lock` in it, locked with flock() while the writer
// lives, so that the kernel gives it back however the writer ends. The file says who holds it. Local file
// systems and NFS (Linux, version 3 with its lock service, or 4) honour the lock; where a file system has
// none, or hides the locks of other machines, the claim that stands in the file counts until it is two
// minutes old. A writer renews it every ten seconds; the clocks of the machines must agree to a minute.
#pragma once
#include <atomic>
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
  bool is_held() const { return held_; }  // false once another took the claim over, or the file is gone
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  void renew();
  bool is_mine() const;

  std::filesystem::path path_;
  int descriptor_ = -1;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::atomic<bool> held_{true};
  std::thread renewer_;
};

}  // namespace firn
