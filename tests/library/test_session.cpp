// SPDX-License-Identifier: MIT
// Sessions as programs of others have them: progress, cancellation at any frame, resumption, and several at a
// time.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/folder.h"
#include "tests/library/refusal.h"

namespace firn::test::session {
namespace {

namespace fs = std::filesystem;

const std::string kScene = FIRN_SOURCE_ROOT "/tests/program/tiny.toml";

SessionOptions into(const std::string& folder, int threads = 2) {
  SessionOptions options;
  options.out = folder;
  options.threads = threads;
  return options;
}

// Of each frame the hashes of its snow and its picture.
std::map<int, std::string> hashes(const std::string& folder) {
  std::map<int, std::string> found;
  std::ifstream in(folder + "/frames.jsonl");
  const std::regex frame(R"re("frame":\s*(\d+))re"),
      hash(R"re("(?:particles|picture)_hash":\s*"([0-9a-f]+)")re");
  for (std::string line; std::getline(in, line);) {
    std::smatch number;
    if (!std::regex_search(line, number, frame)) continue;
    std::string all;
    for (std::sregex_iterator h(line.begin(), line.end(), hash), end; h != end; ++h)
      all += (*h)[1].str() + " ";
    found[std::stoi(number[1])] = all;
  }
  return found;
}

// Counts what it is told, and asks for a stop when a stage of a frame begins.
class Counting : public Observer {
 public:
  Counting() = default;
  Counting(Stage stage, int frame) : stage_(static_cast<int>(stage)), frame_(frame) {}
  void message(const std::string&) override { ++messages; }
  void frames_begin(int count, double) override { expected = count; }
  void frames_end() override { ++ends; }
  void stage_begins(Stage stage, int frame) override {
    if (static_cast<int>(stage) == stage_ && frame == frame_) source.request_stop();
  }
  void stage_ends(Stage stage, int) override {
    if (stage == Stage::write) ++written;
  }

  std::atomic<int> messages{0}, expected{0}, ends{0}, written{0};
  std::stop_source source;

 private:
  const int stage_ = -1, frame_ = -1;
};

class Failing : public Observer {
 public:
  void stage_begins(Stage stage, int frame) override {
    if (stage == Stage::trace && frame == 1) throw std::runtime_error("the listener fell ill");
  }
};

}  // namespace

TEST_CASE("A session cancelled in any stage of any frame goes on to the bits of one that was not") {
  const Folder here;
  const Scene scene = Scene::read(kScene);
  Counting counting;
  Session whole = Session::start(scene, into(here / "whole"), counting);
  CHECK(whole.folder() == here / "whole");
  CHECK_FALSE(whole.run().interrupted);
  CHECK(counting.expected == scene.frames());
  CHECK(counting.written == scene.frames());
  CHECK(counting.ends >= 1);
  CHECK(counting.messages >= 1);
  const auto wanted = hashes(here / "whole");
  REQUIRE(wanted.size() == static_cast<std::size_t>(scene.frames()));
  for (const Stage stage : {Stage::simulate, Stage::trace, Stage::write}) {
    for (int frame = 0; frame < scene.frames(); ++frame) {
      INFO("stage " << static_cast<int>(stage) << " of frame " << frame);
      const std::string run = here / std::to_string(10 * frame + static_cast<int>(stage));
      Counting stopping(stage, frame);
      const SessionResult stopped =
          Session::start(scene, into(run), stopping).run(stopping.source.get_token());
      if (stopped.interrupted)
        CHECK(stopped.kept + stopped.left.size() == static_cast<std::size_t>(scene.frames()));
      const SessionResult rest = Session::resume(run, into(run)).run();
      CHECK_FALSE(rest.interrupted);
      CHECK(rest.nothing_to_do == !stopped.interrupted);
      CHECK(hashes(run) == wanted);
    }
  }
}

TEST_CASE("A stop that was requested before the run begins leaves a run that can be gone on with") {
  const Folder here;
  std::stop_source source;
  source.request_stop();
  const SessionResult stopped = Session::start(Scene::read(kScene), into(here / "a")).run(source.get_token());
  CHECK(stopped.interrupted);
  CHECK(stopped.kept == 0);
  CHECK_FALSE(Session::resume(here / "a").run().interrupted);
}

TEST_CASE("Sessions at the same time, with threads of their own, make the same bits as each alone") {
  const Folder here;
  const Scene scene = Scene::read(kScene);
  Session::start(scene, into(here / "alone", 1)).run();
  std::vector<std::thread> threads;
  for (int k = 1; k <= 3; ++k)
    threads.emplace_back([&, k] { Session::start(scene, into(here / std::to_string(k), k)).run(); });
  for (std::thread& thread : threads) thread.join();
  for (int k = 1; k <= 3; ++k) CHECK(hashes(here / std::to_string(k)) == hashes(here / "alone"));
}

TEST_CASE("A session runs once") {
  const Folder here;
  Session session = Session::start(Scene::read(kScene), into(here / "a"));
  session.run();
  CHECK(refusal([&] { session.run(); }).code() == ErrorCode::usage);
}

TEST_CASE("A folder has one session at a time") {
  const Folder here;
  const Scene scene = Scene::read(kScene);
  Session::start(scene, into(here / "a")).run();
  {
    const Session first = Session::resume(here / "a");
    CHECK(refusal([&] { Session::resume(here / "a"); }).code() == ErrorCode::io);
  }
  CHECK(Session::resume(here / "a").run().nothing_to_do);
}

TEST_CASE("Pictures are added to a run of particles, in its folder and as a run of its own") {
  const Folder here;
  const Scene scene = Scene::read(kScene);
  Session::start(scene, into(here / "whole")).run();
  SessionOptions simulate = into(here / "snow");
  simulate.pictures = simulate.movie = false;
  simulate.particles = true;
  Session::start(scene, simulate).run();
  Session shared = Session::render(here / "snow");
  CHECK(shared.shares());
  shared.run();
  Session::render(here / "snow", into(here / "own")).run();
  const auto wanted = hashes(here / "whole");
  for (const auto& [frame, hash] : wanted) {
    CHECK(hashes(here / "snow").at(frame) == hash);
    CHECK(hashes(here / "own").at(frame) == hash);
  }
}

TEST_CASE("What cannot be done is refused with a code, and leaves nothing behind") {
  const Folder here;
  const Scene scene = Scene::read(kScene);
  CHECK(refusal([&] { Session::resume(here / "nothing"); }).code() == ErrorCode::io);
  for (const auto& frames : {std::pair(2, 1), std::pair(-1, 1), std::pair(0, 1000)}) {
    SessionOptions options = into(here / "a");
    options.frames = frames;
    const Error error = refusal([&] { Session::start(scene, options); });
    CHECK(error.code() == ErrorCode::usage);
    CHECK(error.where() == "frames");
  }
  SessionOptions options = into(here / "a");
  options.isa = "z80";
  CHECK(refusal([&] { Session::start(scene, options); }).code() == ErrorCode::usage);
  CHECK(refusal([&] { Session::start(Scene("empty"), into(here / "a")); }).code() == ErrorCode::usage);
  CHECK_FALSE(fs::exists(here / "a"));
}

TEST_CASE("An observer that throws ends its session, which can be gone on with") {
  const Folder here;
  Failing failing;
  const Scene scene = Scene::read(kScene);
  CHECK_THROWS_WITH(Session::start(scene, into(here / "a"), failing).run(), "the listener fell ill");
  CHECK_FALSE(Session::resume(here / "a").run().interrupted);
  Session::start(scene, into(here / "b")).run();
  CHECK(hashes(here / "a") == hashes(here / "b"));
}

TEST_CASE("The version of the library is that of the headers") {
  CHECK(version() == std::to_string(FIRN_VERSION_MAJOR) + "." + std::to_string(FIRN_VERSION_MINOR) + "." +
                         std::to_string(FIRN_VERSION_PATCH));
  CHECK_FALSE(revision().empty());
}

}  // namespace firn::test::session
