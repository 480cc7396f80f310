// SPDX-License-Identifier: MIT
// The folder that a run lands in. It is taken before anything is computed, so that a folder that cannot be
// written is known at once; it is given back (removed, if it was made here) unless the run begins, so that a
// scene error found later leaves nothing behind. No run is ever overwritten unasked.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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

  void begin();  // from here on the folder stays; removes the earlier run's files if overwriting

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path manifest() const { return path_ / "run.json"; }
  std::filesystem::path scene() const { return path_ / "scene.resolved.toml"; }
  std::filesystem::path log() const { return path_ / "log.txt"; }
  std::filesystem::path metrics() const { return path_ / "metrics.csv"; }
  std::filesystem::path trace() const { return path_ / "trace.json"; }
  std::filesystem::path movie() const { return path_ / "movie"; }  // without extension
  std::filesystem::path frames() const { return path_ / "frames"; }
  std::filesystem::path particles() const { return path_ / "particles"; }
  std::filesystem::path checkpoint() const { return path_ / "checkpoints" / "latest.checkpoint"; }
  std::filesystem::path frame(int number, const std::string& extension) const;  // frames/0007.png
  std::filesystem::path particle_file(int number) const;                        // particles/0007.firn

 private:
  RunFolder() = default;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  // folders that did not exist before, outermost first
  bool overwrite_ = false;
};

}  // namespace firn
