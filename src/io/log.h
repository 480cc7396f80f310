// SPDX-License-Identifier: MIT
// log.txt: what a run told its people, with the time in UTC; appended to by every session of the run.
#pragma once
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>

namespace firn {

class Log {
 public:
  void open(const std::filesystem::path& path);  // io Error if it cannot be written
  void add(const std::string& line);             // nothing before open()

 private:
  std::mutex mutex_;
  std::ofstream out_;
};

}  // namespace firn
