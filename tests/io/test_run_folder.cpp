// SPDX-License-Identifier: MIT
// Who may write where: no run is overwritten unasked, a run that never began leaves nothing.
#include <unistd.h>

#include "src/core/error.h"
#include "src/io/file.h"
#include "src/io/run_folder.h"
#include "tests/catch.h"
#include "tests/io/scratch.h"

using namespace firn;
namespace fs = std::filesystem;

namespace {

// The working directory is a scratch folder while it lives.
struct Inside {
  Inside() { fs::current_path(scratch.path()); }
  ~Inside() { fs::current_path(old); }
  const fs::path old = fs::current_path();
  Scratch scratch;
};

void make_run(const std::string& path) {
  RunFolder folder = RunFolder::take("x", path, false);
  folder.begin();
  write_file(folder.manifest(), "{}");
  write_file(folder.frame(0, "png"), "picture");
}

ExitCode refusal(const std::string& path, bool overwrite, const std::string& message) {
  try {
    RunFolder::take("x", path, overwrite);
  } catch (const Error& error) {
    CHECK_THAT(error.what(), contains(message));
    return error.code();
  }
  return ExitCode::ok;
}

}  // namespace

TEST_CASE("Without --out every run gets a free folder of its own") {
  Inside inside;
  for (const std::string name : {"out/ball", "out/ball-2", "out/ball-3"}) {
    RunFolder folder = RunFolder::take("ball", std::nullopt, false);
    folder.begin();
    CHECK(folder.path() == name);
    CHECK(fs::is_directory(folder.frames()));
  }
}

TEST_CASE("A folder that holds a run is refused, naming resume and --overwrite") {
  Inside inside;
  make_run("a");
  CHECK(refusal("a", false, "firn resume a") == ExitCode::usage);
  CHECK(refusal("a", false, "--overwrite") == ExitCode::usage);
  CHECK(fs::exists("a/frames/0000.png"));
}

TEST_CASE("--overwrite removes the files of the run and no others, and only when the new run begins") {
  Inside inside;
  make_run("a");
  write_file("a/notes.txt", "mine");
  RunFolder folder = RunFolder::take("x", "a", true);
  CHECK(fs::exists("a/frames/0000.png"));
  folder.begin();
  CHECK_FALSE(fs::exists("a/frames/0000.png"));
  CHECK_FALSE(fs::exists("a/run.json"));
  CHECK(read_file("a/notes.txt") == "mine");
}

TEST_CASE("Files that no run made are never taken for a run's") {
  Inside inside;
  fs::create_directories("a/frames");
  CHECK(refusal("a", false, "'frames'") == ExitCode::usage);
  CHECK(refusal("a", true, "'frames'") == ExitCode::usage);
}

TEST_CASE("A folder that cannot be written is an io Error that names it, before anything is made") {
  Inside inside;
  write_file("file", "");
  CHECK(refusal("file", false, "it is a file") == ExitCode::io);
  CHECK(refusal("file/deeper/out", false, "file/deeper") == ExitCode::io);
  CHECK(refusal("/proc/firn/out", false, "/proc/firn") == ExitCode::io);
  if (::geteuid() != 0) {
    fs::create_directory("locked");
    fs::permissions("locked", fs::perms::owner_read | fs::perms::owner_exec);
    CHECK(refusal("locked", false, "ermission denied") == ExitCode::io);
  }
}

TEST_CASE("A run that is never begun gives its folder back, with the parents it made") {
  Inside inside;
  fs::create_directory("there");
  { RunFolder folder = RunFolder::take("x", "there/a/b/c", false); }
  CHECK(fs::is_empty("there"));
  { RunFolder folder = RunFolder::take("x", "there", false); }
  CHECK(fs::exists("there"));
}

TEST_CASE("Opening a folder without a run is an io Error") {
  Inside inside;
  CHECK_THROWS_WITH(RunFolder::open("nothing"), contains("nothing") && contains("run.json"));
}
