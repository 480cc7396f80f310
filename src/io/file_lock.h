// SPDX-License-Identifier: MIT
// A lock that is a file: locked with flock() while its holder lives, so that the kernel gives it back however
// the holder ends, and gone when nobody holds it. The file says who does. Local file systems and NFS (Linux,
// version 3 with its lock service, or 4) honour the lock; where a file system has none, or hides the locks of
// other machines, the claim that stands in the file counts until it is two minutes old. A holder renews it
// every ten seconds; the clocks of the machines must agree to a minute.
#pragma once
#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <thread>

namespace firn {

class FileLock {
 public:
  enum class Kind { exclusive, shared };  // one holder, or any number

  // Errors: io Error that names the host and the process of another holder, or if the file cannot be made.
  // `where` is what the error is about.
  FileLock(const std::filesystem::path& path, Kind kind, const std::filesystem::path& where);
  // Exclusive; null if another holds it. Errors: io Error if the file cannot be made.
  static std::unique_ptr<FileLock> try_take(const std::filesystem::path& path);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  // From exclusive to shared. Errors: io Error if another was quicker.
  void share();
  // False once another has it, or the name leads elsewhere.
  bool is_held() const { return held_ && stands(); }

 private:
  FileLock(std::filesystem::path path, Kind kind, int descriptor);
  int write_claim() const;  // 0, or errno
  void renew();
  bool stands() const;

  std::filesystem::path path_;
  std::atomic<Kind> kind_;
  int descriptor_ = -1;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::atomic<bool> held_{true};
  std::thread renewer_;
};

}  // namespace firn
