// SPDX-License-Identifier: MIT
// Colliders that a program drives in a run, which goes on with them alone.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/folder.h"
#include "tests/library/refusal.h"
#include "tests/library/small_scenes.h"

namespace firn::test::driven_session {
namespace {

using Catch::Matchers::Contains;

constexpr int kFrames = 6;

Scene pushed() {
  Scene scene = with_plate();
  scene.set("time.frames", kFrames).set("time.fps", 100).set("output.checkpoint_every", 2);
  scene.set("output.formats", Value::Array{"pfm"}).set("output.movie", false);
  scene.set("camera.position", {0.5, 0.5, 0.9}).set("camera.target", {0, 0.12, 0});
  return scene.set("image.width", 32).set("image.height", 24).set("image.samples", 2);
}

// A function of time alone, so that it goes on from any moment.
ColliderVelocity push(const DrivenCollider& now) { return {{2 + 10 * now.time, 0, 0}, {0, 5, 0}}; }

SessionOptions into(const std::string& folder, bool overlap = true) {
  SessionOptions options;
  options.out = folder;
  options.overlap = overlap;
  options.particles = true;
  return options;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Pictures and particles, one after another.
std::string frames_of(const std::string& run) {
  std::string all;
  for (int frame = 0; frame < kFrames; ++frame) {
    const std::string name = "/000" + std::to_string(frame);
    const std::string picture = bytes_of(run + "/frames" + name + ".pfm");
    const std::string snow = bytes_of(run + "/particles" + name + ".firn");
    REQUIRE_FALSE(picture.empty());
    REQUIRE_FALSE(snow.empty());
    all += picture + snow;
  }
  return all;
}

// Asks for a stop when a stage of a frame begins.
struct Stopper : Observer {
  Stopper(Stage at, int number) : stage(at), frame(number) {}
  void stage_begins(Stage begun, int number) override {
    if (begun == stage && number == frame) stop.request_stop();
  }
  Stage stage;
  int frame;
  std::stop_source stop;
};

void run_whole(const std::string& folder, bool overlap = true) {
  Session session = Session::start(pushed(), into(folder, overlap));
  session.drive("plate", push);
  session.run();
}

}  // namespace

TEST_CASE("a run with a driver has the same bits with and without overlap, and those of a simulation") {
  const Folder folder;
  run_whole(folder / "a");
  run_whole(folder / "b", false);
  const std::string frames = frames_of(folder / "a");
  CHECK(frames == frames_of(folder / "b"));
  Session still = Session::start(pushed(), into(folder / "still"));
  still.run();
  CHECK(frames != frames_of(folder / "still"));

  const Scene scene = pushed();
  Simulation simulation(scene);
  Renderer renderer(scene);
  simulation.drive("plate", push);
  for (int frame = 0; frame < kFrames; ++frame) simulation.advance_to(scene.frame_time(frame));
  Snapshot snow = simulation.snapshot();
  snow.frame = kFrames - 1;
  write_picture(renderer.render(snow), folder / "last.pfm");
  CHECK(bytes_of(folder / "last.pfm") == bytes_of(folder / "a/frames/0005.pfm"));
}

TEST_CASE("a run with a driver goes on when it is driven again, and not without") {
  const Folder folder;
  run_whole(folder / "whole");
  const std::string whole = frames_of(folder / "whole");
  for (const Stage stage : {Stage::simulate, Stage::trace, Stage::write}) {
    for (const int frame : {0, 1, 3, 5}) {
      const std::string run =
          folder / ("run" + std::to_string(static_cast<int>(stage)) + std::to_string(frame));
      Stopper stopper(stage, frame);
      {
        Session session = Session::start(pushed(), into(run), stopper);
        session.drive("plate", push);
        session.run(stopper.stop.get_token());
      }
      const std::string before = bytes_of(run + "/run.json");
      Session without = Session::resume(run);
      if (before.find("\"interrupted\"") == std::string::npos) continue;  // the stop came too late
      const Error error = refusal([&] { without.run(); });
      CHECK(error.code() == ErrorCode::usage);
      CHECK_THAT(error.what(), Contains("drives collider 'plate'"));
      CHECK(bytes_of(run + "/run.json") == before);
      without.drive("plate", push);  // and then it may
      without.run();
      CHECK(frames_of(run) == whole);
    }
  }
}

TEST_CASE("what may be driven in a session") {
  const Folder folder;
  {
    Session session = Session::start(pushed(), into(folder / "run"));
    CHECK_THAT(refusal([&] { session.drive("plat", push); }).what(), Contains("ground, plate"));
    CHECK_THAT(refusal([&] { session.drive("plate", {}); }).what(), Contains("empty"));
    session.drive("plate", push);
    session.drive("plate", push);  // the later one counts
    session.run();
    CHECK_THAT(refusal([&] { session.drive("plate", push); }).what(), Contains("has run already"));
  }
  // Complete: nothing is simulated, so that nothing is asked for.
  CHECK(Session::resume(folder / "run").run().nothing_to_do);
  Session::start(pushed(), into(folder / "still")).run();
  Session again = Session::resume(folder / "still");
  CHECK_THAT(refusal([&] { again.drive("plate", push); }).what(), Contains("was not driven"));
}

TEST_CASE("what a driver throws ends the run, and comes out of it") {
  const Folder folder;
  {
    Session session = Session::start(pushed(), into(folder / "run"));
    session.drive("plate", [](const DrivenCollider& now) -> ColliderVelocity {
      if (now.time > 0.02) throw std::domain_error("lost");
      return {};
    });
    CHECK_THROWS_AS(session.run(), std::domain_error);
  }
  CHECK_THAT(bytes_of(folder / "run/run.json"), Contains("lost"));
  Session again = Session::resume(folder / "run");
  again.drive("plate", [](const DrivenCollider&) { return ColliderVelocity{}; });
  CHECK_NOTHROW(again.run());
  frames_of(folder / "run");
}

TEST_CASE("a recorded run with a driver is rendered with the collider where it was") {
  const Folder folder;
  SessionOptions options = into(folder / "snow");
  options.pictures = false;
  {
    Session session = Session::start(pushed(), options);
    session.drive("plate", push);
    session.run();
  }
  run_whole(folder / "whole");
  Session::render(folder / "snow").run();
  CHECK(frames_of(folder / "snow") == frames_of(folder / "whole"));
}

}  // namespace firn::test::driven_session
