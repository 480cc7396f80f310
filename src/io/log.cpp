// SPDX-License-Identifier: MIT
#include "src/io/log.h"

#include <cerrno>
#include <cstring>
#include <string>

#include "firn/error.h"
#include "src/io/version.h"

namespace firn {

void Log::open(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    throw Error(ErrorCode::io, path.string(), "cannot write the log: it is not a file");
  errno = 0;
  out_.open(path, std::ios::app);
  if (!out_)
    throw Error(ErrorCode::io, path.string(), std::string("cannot write the log: ") + std::strerror(errno));
}

void Log::add(const std::string& line) {
  const std::lock_guard lock(mutex_);
  if (out_.is_open()) out_ << utc_now() << "  " << line << std::endl;
}

}  // namespace firn
