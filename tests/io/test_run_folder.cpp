// SPDX-License-Identifier: MIT
// Who may write where: no run is overwritten unasked, a run that never began leaves nothing.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "firn/error.h"
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

// As a run does: the manifest first.
void begin(RunFolder& folder) {
  folder.lock();
  write_file(folder.manifest(), "{\"revision\": \"\", \"scene_hash\": \"\"}");
  folder.clear();
  folder.begin();
}

void make_run(const std::string& path) {
  RunFolder folder = RunFolder::take("x", path, false);
  begin(folder);
  write_file(folder.frame(0, "png"), "picture");
  folder.keep();
}

std::vector<std::string> entries_of(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

ErrorCode refusal(const std::string& path, bool overwrite, const std::string& message) {
  try {
    RunFolder::take("x", path, overwrite);
  } catch (const Error& error) {
    CHECK_THAT(error.what(), contains(message));
    return error.code();
  }
  return ErrorCode::failed;
}

}  // namespace

TEST_CASE("Without --out every run gets a free folder of its own") {
  Inside inside;
  for (const std::string name : {"out/ball", "out/ball-2", "out/ball-3"}) {
    RunFolder folder = RunFolder::take("ball", std::nullopt, false);
    begin(folder);
    folder.keep();
    CHECK(folder.path() == name);
    CHECK(fs::is_directory(folder.frames()));
  }
}

TEST_CASE("A folder that holds a run is refused, naming resume and --overwrite") {
  Inside inside;
  make_run("a");
  CHECK(refusal("a", false, "firn resume a") == ErrorCode::usage);
  CHECK(refusal("a", false, "--overwrite") == ErrorCode::usage);
  CHECK(fs::exists("a/frames/0000.png"));
}

TEST_CASE("--overwrite removes the files of the run and no others, and only when the new run begins") {
  Inside inside;
  make_run("a");
  write_file("a/notes.txt", "mine");
  RunFolder folder = RunFolder::take("x", "a", true);
  CHECK(fs::exists("a/frames/0000.png"));
  begin(folder);
  CHECK_FALSE(fs::exists("a/frames/0000.png"));
  CHECK(fs::exists("a/run.json"));
  CHECK(read_file("a/notes.txt") == "mine");
}

TEST_CASE("Files that no run made are never taken for a run's") {
  Inside inside;
  fs::create_directories("a/frames");
  CHECK(refusal("a", false, "'frames'") == ErrorCode::usage);
  CHECK(refusal("a", true, "'frames'") == ErrorCode::usage);
}

TEST_CASE("A folder that cannot be written is an io Error that names it, before anything is made") {
  Inside inside;
  write_file("file", "");
  CHECK(refusal("file", false, "it is not a folder") == ErrorCode::io);
  CHECK(refusal("file/deeper/out", false, "file/deeper") == ErrorCode::io);
  CHECK(refusal("/proc/firn/out", false, "/proc/firn") == ErrorCode::io);
  if (::geteuid() != 0) {
    fs::create_directory("locked");
    fs::permissions("locked", fs::perms::owner_read | fs::perms::owner_exec);
    CHECK(refusal("locked", false, "ermission denied") == ErrorCode::io);
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
  CHECK_THROWS_WITH(RunFolder::open("nothing"), contains("nothing: no such folder"));
  write_file("file", "");
  CHECK_THROWS_WITH(RunFolder::open("file"), contains("file: it is not a folder"));
  CHECK_THROWS_WITH(RunFolder::open("file/inner"), contains("file/inner: "));
  fs::create_directory("there");
  CHECK_THROWS_WITH(RunFolder::open("there"),
                    contains("there: no run is in this folder (it has no run.json)"));
}

TEST_CASE("A run that ends before it has a manifest leaves nothing, and nothing of others is taken") {
  Inside inside;
  fs::create_directory("there");
  write_file("there/notes.txt", "mine");
  for (const std::string path : {"there", "new/a"}) {
    RunFolder folder = RunFolder::take("x", path, false);
    begin(folder);
    write_file(folder.scene(), "[camera]");
    write_file(folder.frame(0, "png"), "picture");
  }
  CHECK_FALSE(fs::exists("new"));
  CHECK(entries_of("there") == std::vector<std::string>{"notes.txt"});
}

TEST_CASE("Only one writer is in a run folder, and the refusal names it") {
  Inside inside;
  make_run("a");
  RunFolder first = RunFolder::open("a"), second = RunFolder::open("a");
  first.lock();
  first.lock();  // has it already
  CHECK_THROWS_WITH(second.lock(),
                    contains("process " + std::to_string(::getpid())) && contains("written by"));
  CHECK_THROWS_AS(RunFolder::take("x", "a", true), Error);
  CHECK(fs::exists("a/frames/0000.png"));
  { const RunFolder done = std::move(first); }
  CHECK_FALSE(fs::exists("a/.firn-lock"));
  second.lock();
}

TEST_CASE("A writer whose lock was taken away knows it, and leaves the lock of the next one alone") {
  Inside inside;
  make_run("a");
  RunFolder next = RunFolder::open("a");
  {
    RunFolder first = RunFolder::open("a");
    first.lock();
    fs::remove("a/.firn-lock");
    next.lock();
  }
  CHECK(fs::exists("a/.firn-lock"));
  CHECK_NOTHROW(next.require_lock());
  CHECK_THROWS_AS(RunFolder::open("a").lock(), Error);
}

TEST_CASE(
    "A lock is never a link to a file of somebody else, and a claim from the future holds for two minutes at "
    "most") {
  Inside inside;
  make_run("a");
  write_file("victim", "precious");
  fs::create_symlink("../victim", "a/.firn-lock");
  CHECK_THROWS_AS(RunFolder::open("a").lock(), Error);
  CHECK(read_file("victim") == "precious");
  fs::remove("a/.firn-lock");
  write_file("a/.firn-lock", "elsewhere 5\n");
  fs::last_write_time("a/.firn-lock", fs::file_time_type::clock::now() + std::chrono::hours(24));
  RunFolder folder = RunFolder::open("a");
  folder.lock();
}

TEST_CASE("A run.json that is none of firn's is not overwritten, nor is anything beside it") {
  Inside inside;
  fs::create_directories("a/frames");
  write_file("a/run.json", "{\"mine\": 1}");
  write_file("a/frames/thesis.txt", "precious");
  CHECK(refusal("a", true, "not of a run of firn") == ErrorCode::usage);
  CHECK(read_file("a/frames/thesis.txt") == "precious");
}

TEST_CASE("The claim of another machine counts until it is two minutes old") {
  Inside inside;
  make_run("a");
  write_file("a/.firn-lock", "elsewhere 1234\n");
  CHECK_THROWS_WITH(RunFolder::open("a").lock(),
                    contains("process 1234 on elsewhere") && contains("try again in"));
  fs::last_write_time("a/.firn-lock", fs::file_time_type::clock::now() - std::chrono::seconds(125));
  RunFolder folder = RunFolder::open("a");
  folder.lock();
  CHECK_THROWS_WITH(RunFolder::open("a").lock(), contains("process " + std::to_string(::getpid())));
}

TEST_CASE("A claim of this machine whose process is gone does not count") {
  Inside inside;
  make_run("a");
  char host[256] = {};
  REQUIRE(::gethostname(host, sizeof host - 1) == 0);
  write_file("a/.firn-lock", std::string(host) + " 1\n");
  RunFolder folder = RunFolder::open("a");
  folder.lock();
}

TEST_CASE("A session sweeps up what a killed one did not finish") {
  Inside inside;
  make_run("a");
  for (const std::string name : {"a/run.json.part", "a/frames/0003.png.part", "a/movie.part.mp4"})
    write_file(name, "half");
  for (const std::string name : {"a/notes.part.txt", "a/film.iso.part", "a/movie.part.txt", "a/lock"})
    write_file(name, "mine");
  RunFolder folder = RunFolder::open("a");
  folder.begin();
  CHECK(entries_of("a/frames") == std::vector<std::string>{"0000.png"});
  CHECK_FALSE(fs::exists("a/run.json.part"));
  CHECK_FALSE(fs::exists("a/movie.part.mp4"));
  for (const std::string name : {"a/notes.part.txt", "a/film.iso.part", "a/movie.part.txt", "a/lock"})
    CHECK(read_file(name) == "mine");
}

TEST_CASE("Saved checkpoints are found by their frames, the latest first") {
  Inside inside;
  make_run("a");
  RunFolder folder = RunFolder::open("a");
  CHECK(folder.saved_checkpoints().empty());
  for (const int frame : {7, 12, 100000, 0}) write_file(folder.checkpoint(frame), "x");
  for (const std::string name : {"latest.checkpoint", "12.checkpoint", "0003.txt"})
    write_file(folder.checkpoints() / name, "x");
  CHECK(folder.saved_checkpoints() == std::vector<int>{100000, 12, 7, 0});
}

TEST_CASE("Several processes share a run, and a writer is let in when the last of them has gone") {
  Inside inside;
  make_run("a");
  RunFolder writer = RunFolder::open("a");
  {
    RunFolder second = RunFolder::open("a");
    {
      RunFolder first = RunFolder::open("a");
      CHECK(first.lock_shared());
      CHECK_THROWS_WITH(writer.lock(), contains("written by process " + std::to_string(::getpid())));
      first.share_with_others();
      CHECK_FALSE(second.lock_shared());
      CHECK_NOTHROW(first.require_lock());
      CHECK_NOTHROW(second.require_lock());
      CHECK_THROWS_AS(writer.lock(), Error);
    }
    CHECK(fs::exists("a/.firn-lock"));
    CHECK_NOTHROW(second.require_lock());
    CHECK_THROWS_AS(writer.lock(), Error);
  }
  CHECK_FALSE(fs::exists("a/.firn-lock"));
  writer.lock();
  CHECK_THROWS_WITH(RunFolder::open("a").lock_shared(), contains("written by"));
}

TEST_CASE("The claim of another machine bars sharing if it is a writer's, and writing whatever it is") {
  Inside inside;
  make_run("a");
  const auto claim = [](const char* text) { write_file("a/.firn-lock", text); };
  claim("elsewhere 5\n");
  CHECK_THROWS_WITH(RunFolder::open("a").lock_shared(), contains("process 5 on elsewhere"));
  claim("elsewhere 5 shared\n");
  CHECK_THROWS_WITH(RunFolder::open("a").lock(), contains("process 5 on elsewhere"));
  RunFolder folder = RunFolder::open("a");
  CHECK_FALSE(folder.lock_shared());
  CHECK_NOTHROW(folder.require_lock());
}

TEST_CASE("A frame is claimed by one at a time, and claims of the dead are swept or taken over") {
  Inside inside;
  make_run("a");
  RunFolder one = RunFolder::open("a"), other = RunFolder::open("a");
  auto claim = one.claim(7);
  REQUIRE(claim);
  CHECK(other.claim(8));
  CHECK_FALSE(other.claim(7));
  claim.reset();
  CHECK(other.claim(7));
  CHECK(entries_of("a/frames") == std::vector<std::string>{"0000.png"});
  write_file("a/frames/0007.firn-claim", "elsewhere 5\n");
  CHECK_FALSE(one.claim(7));  // of another machine, and young
  fs::last_write_time("a/frames/0007.firn-claim", fs::file_time_type::clock::now() - std::chrono::minutes(3));
  CHECK(one.claim(7));
  write_file("a/frames/0009.firn-claim", "");
  one.lock();
  one.begin();
  CHECK(entries_of("a/frames") == std::vector<std::string>{"0000.png"});
}
