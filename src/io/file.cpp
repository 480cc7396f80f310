// SPDX-License-Identifier: MIT
#include "src/io/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "firn/error.h"
#include "src/core/memory.h"

namespace firn {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const char* verb, int error) {
  throw Error(ErrorCode::io, path.string(), std::string("cannot ") + verb + ": " + std::strerror(error));
}

// 0, or the errno of the first call that failed.
int write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

// How many bytes could be read: fewer at the end of the file, or, with errno set, where reading failed.
std::size_t read_all(int descriptor, char* bytes, std::size_t count) {
  std::size_t done = 0;
  errno = 0;
  while (done < count) {
    const ssize_t got = ::read(descriptor, bytes + done, count - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return done;
    done += static_cast<std::size_t>(got);
  }
  errno = 0;
  return done;
}

struct Descriptor {
  int number;
  explicit Descriptor(int n) : number(n) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

// Some file systems cannot flush (EINVAL); the bytes are then as safe as they get.
int flush(int descriptor) { return ::fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno; }

}  // namespace

fs::path replaceable(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw Error(ErrorCode::io, path.string(), "this is no regular file, and a file is replaced as a whole");
  const fs::path target = fs::is_symlink(path, ignored) ? fs::weakly_canonical(path, ignored) : path;
  return ignored || target.empty() ? path : target;
}

void write_file(const fs::path& path, std::string_view bytes) { write_pieces(path, {&bytes, 1}); }

void write_pieces(const fs::path& path, std::span<const std::string_view> pieces) {
  const fs::path temporary = path.string() + ".part";
  const int descriptor =
      ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK, 0666);
  if (descriptor < 0) fail(path, "write", errno);
  int error = 0;
  for (const std::string_view piece : pieces) {
    if (error == 0) error = write_all(descriptor, piece);
  }
  if (error == 0) error = flush(descriptor);
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    fail(path, "write", error);
  }
}

void append_line(const fs::path& path, std::string_view line) {
  const Descriptor file{::open(path.c_str(), O_RDWR | O_APPEND | O_CLOEXEC | O_NONBLOCK)};
  if (file.number < 0) fail(path, "write", errno);
  ::flock(file.number, LOCK_EX);  // where there are none, one write of a line is whole all the same
  char last = '\n';               // stays so in an empty file
  const off_t end = ::lseek(file.number, 0, SEEK_END);
  const bool cut_off = end > 0 && ::pread(file.number, &last, 1, end - 1) == 1 && last != '\n';
  int error = cut_off ? write_all(file.number, "\n") : 0;
  if (error == 0) error = write_all(file.number, line);
  if (error == 0) error = flush(file.number);
  if (error != 0) fail(path, "write", error);
}

std::string read_file(const fs::path& path, std::size_t from) {
  // A pipe without a writer would let even open() wait.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  struct stat status {};
  if (file.number < 0 || ::fstat(file.number, &status) != 0) fail(path, "read", errno);
  if (S_ISDIR(status.st_mode)) fail(path, "read", EISDIR);
  if (!S_ISREG(status.st_mode)) {
    throw Error(ErrorCode::io, path.string(), "cannot read: it is a pipe or a device, not a file");
  }
  const std::size_t size = static_cast<std::size_t>(status.st_size);
  if (from > 0 && ::lseek(file.number, static_cast<off_t>(from), SEEK_SET) < 0) fail(path, "read", errno);
  if (size > machine_memory()) fail(path, "read", EFBIG);
  std::string bytes(size > from ? size - from : 0, '\0');
  if (read_all(file.number, bytes.data(), bytes.size()) != bytes.size())
    fail(path, "read", errno ? errno : EIO);
  return bytes;
}

std::string read_standard_input(std::size_t most) {
  std::string bytes(most + 1, '\0');
  errno = 0;
  bytes.resize(read_all(STDIN_FILENO, bytes.data(), bytes.size()));
  if (errno != 0) fail("the standard input", "read", errno);
  if (bytes.size() > most) {
    throw Error(ErrorCode::io, "the standard input",
                "more than " + std::to_string(most >> 20) + " MiB are not read");
  }
  return bytes;
}

std::uint64_t hash_bytes(const void* bytes, std::size_t size) { return XXH3_64bits(bytes, size); }

std::uint64_t hash_pieces(std::span<const std::string_view> pieces) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_64bits_reset(state.get());
  for (const std::string_view piece : pieces) XXH3_64bits_update(state.get(), piece.data(), piece.size());
  return XXH3_64bits_digest(state.get());
}

std::string hex(std::uint64_t hash) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

std::string hash_in_hex(std::string_view bytes) { return hex(hash_bytes(bytes.data(), bytes.size())); }

}  // namespace firn
