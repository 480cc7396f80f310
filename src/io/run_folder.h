// SPDX-License-Identifier: MIT
// The folder that a run lands in. It is taken before anything is computed, so that a folder that cannot be
// written is known at once; it is given back (removed, if it was made here) unless the run is kept, so that a
// scene error found later, or a disk that is full at once, leaves nothing behind. No run is ever overwritten
// unasked, and only one process at a time writes into it, or several that share its frames.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/io/file_lock.h"

namespace firn {

class RunFolder {
 public:
  // `out` empty: out/<scene>, or the next free out/<scene>-2, -3, ... Errors: usage Error if `out` holds a
  // run and not `overwrite`, or holds files of other origin under names that a run needs; io Error if it
  // cannot be written.
  static RunFolder take(const std::string& scene, const std::optional<std::string>& out, bool overwrite);
  // An existing run. Errors: io Error if the folder holds none.
  static RunFolder open(const std::filesystem::path& path);

  RunFolder(RunFolder&&) noexcept;
  RunFolder& operator=(RunFolder&&) noexcept;
  ~RunFolder();

  // From here on other processes are kept out. Errors: io Error if one is in, usage Error if one began a run
  // here since the folder was taken.
  void lock();
  // For a process that only adds to frames, each of which it claims: it shares the run with others that do,
  // and keeps the writers out that lock() it. Of an opened run. True for the only one that is in: it has the
  // run for itself until share_with_others(). Errors: io Error if a writer is in.
  bool lock_shared();
  void share_with_others();
  // Null if another process has the frame.
  std::unique_ptr<FileLock> claim(int frame) const;
  // After the manifest was written, in place of an old run's: removes the other files of that run. Killed
  // before, the old run is whole; killed after, there is a new one to resume.
  void clear();
  void begin();  // the inner folders, without what processes that were killed left behind
  void keep();   // from here on the folder stays
  // Errors: io Error if another process took the lock over.
  void require_lock() const;
  const std::vector<std::filesystem::path>& made() const {
    return made_;
  }  // folders that go again unless it is kept

  // Errors: usage Error for a file that would go with the run that is replaced.
  void require_outside(const std::filesystem::path& file) const;
  bool opened() const { return opened_; }  // an existing run, not taken for a new one
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path manifest() const { return path_ / "run.json"; }
  std::filesystem::path journal() const { return path_ / "frames.jsonl"; }
  std::filesystem::path scene() const { return path_ / "scene.resolved.toml"; }
  std::filesystem::path log() const { return path_ / "log.txt"; }
  std::filesystem::path metrics() const { return path_ / "metrics.csv"; }
  std::filesystem::path trace() const { return path_ / "trace.json"; }
  std::filesystem::path movie() const { return path_ / "movie"; }  // without extension
  std::filesystem::path frames() const { return path_ / "frames"; }
  std::filesystem::path particles() const { return path_ / "particles"; }
  std::filesystem::path checkpoints() const { return path_ / "checkpoints"; }
  std::filesystem::path frame(int number, const std::string& extension) const;  // frames/0007.png
  std::filesystem::path particle_file(int number) const;                        // particles/0007.firn
  std::filesystem::path checkpoint(int number) const;                           // checkpoints/0007.checkpoint
  std::vector<int> saved_checkpoints() const;  // their frames, the latest first

 private:
  RunFolder() = default;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  // that did not exist before, outermost first
  bool overwrite_ = false;
  bool opened_ = false;  // an existing run
  bool fresh_ = false;   // locked, without an earlier run, and not yet kept
  std::unique_ptr<FileLock> lock_;
};

}  // namespace firn
