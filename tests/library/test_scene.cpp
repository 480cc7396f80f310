// SPDX-License-Identifier: MIT
// Scenes made in code are those that a file would make, and their mistakes are named where they were made.
#include <limits>
#include <string>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/refusal.h"

namespace firn::test::scene {
namespace {

const std::string kText = R"(
name = "slope"
[time]
frames = 5
[simulation]
dx = 0.02
seed = 7
[image]
samples = 2
[output]
movie = false
formats = ["png", "pfm"]
[camera]
position = [0, 1, 2]
target = [0, 0.2, 0]
[[snow]]
name = "left"
shape = "ball"
radius = 0.1
center = [0, 0.4, 0]
[[collider]]
shape = "plane"
point = [0, 0, 0]
normal = [0, 1, 0]
motion = [{time = 0, position = [0, 0, 0]}, {time = 1, position = [0, 0.1, 0]}]
)";

Scene made() {
  Scene scene("slope");
  scene.set("time.frames", 5).set("simulation.dx", 0.02).set("simulation.seed", 7u).set("image.samples", 2L);
  scene.set("output.movie", false).set("output.formats", {"png", "pfm"});
  scene.set("camera.position", {0, 1, 2}).set("camera.target", {0, 0.2, 0});
  scene.add("snow", {{"name", "left"}, {"shape", "ball"}, {"radius", 0.1}, {"center", {0, 0.4, 0}}});
  const Table before = {{"time", 0}, {"position", {0, 0, 0}}},
              after = {{"time", 1}, {"position", {0, 0.1, 0}}};
  scene.add("collider",
            {{"shape", "plane"}, {"point", {0, 0, 0}}, {"normal", {0, 1, 0}}, {"motion", {before, after}}});
  return scene;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("A scene made in code is the one that its text makes") {
  CHECK(made().toml() == Scene::parse(kText).toml());
  CHECK(Scene::parse(made().toml()).toml() == made().toml());
  CHECK(made().frames() == 5);
  CHECK(made().frame_time(0) == 0);
  CHECK(made().frame_time(4) == Approx(4 * made().frame_time(1)));
}

TEST_CASE("Values of code replace those of a file, in all records, one by its number, one by its name") {
  Scene scene = Scene::parse(kText);
  scene.add("snow", {{"name", "right"}, {"shape", "ball"}, {"radius", 0.05}, {"center", {1, 0.4, 0}}});
  scene.set("snow.density", 300).set("snow[1].radius", 0.06).set("snow.left.radius", 0.07);
  const std::string text = scene.toml();
  CHECK(has(text, "density = 300"));
  CHECK(has(text, "radius = 0.06"));
  CHECK(has(text, "radius = 0.07"));
  CHECK_FALSE(has(text, "radius = 0.1\n"));
}

TEST_CASE("Copies of a scene are independent") {
  Scene first = made(), second = first;
  second.set("time.frames", 9);
  CHECK(first.frames() == 5);
  first = second;
  second.set("time.frames", 2);
  CHECK(first.frames() == 9);
  const Scene moved = std::move(first);
  CHECK(moved.frames() == 9);
}

TEST_CASE("A mistake is named at its place in the program, or in the words given for it") {
  const int line = __LINE__ + 1;
  Scene wrong = made().set("snow.radius", -1);
  const Error here = refusal([&] { wrong.check(); });
  CHECK(here.code() == ErrorCode::usage);
  CHECK(has(here.where() + ":", "test_scene.cpp:" + std::to_string(line) + ":"));
  CHECK(has(here.what(), "'radius' is -1"));
  wrong = made().set("snow.radius", "wide", Place{"my slider"});
  CHECK(refusal([&] { wrong.check(); }).where() == "my slider");
}

TEST_CASE("Paths that lead nowhere are refused at once, and the scene stays as it is") {
  Scene scene = made();
  const std::string before = scene.toml();
  CHECK(has(refusal([&] { scene.set("snow.right.radius", 1); }).what(), "left"));
  CHECK(has(refusal([&] { scene.set("snow[1].radius", 1); }).what(), "only 1"));
  CHECK(has(refusal([&] { scene.set("camra.fov", 1); }).what(), "'camera'"));
  CHECK(has(refusal([&] { scene.set("", 1); }).what(), "unknown"));
  CHECK(has(refusal([&] { scene.set("light.power", 1); }).what(), "no [[light]]"));
  CHECK(has(refusal([&] { scene.add("snwo", {}); }).what(), "'snow'"));
  CHECK(has(refusal([&] { scene.add("camera", {}); }).what(), "once"));
  CHECK(has(refusal([&] {
              scene.add("snow", {{"radius", 1}, {"radius", 2}});
            }).what(),
            "'radius' is given twice"));
  CHECK(has(refusal([&] { scene.set("simulation.seed", std::numeric_limits<std::uint64_t>::max()); }).what(),
            "2^63"));
  CHECK(scene.toml() == before);
}

TEST_CASE("What only the whole scene shows comes out of check()") {
  CHECK(has(refusal([] { Scene("empty").check(); }).what(), "snow"));
  Scene scene = made();
  scene.add("snow", {{"shape", "ball"}, {"center", {1, 1, 1}}});
  CHECK(has(refusal([&] { scene.check(); }).what(), "radius"));
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    scene = made().set("snow.density", value);
    CHECK(refusal([&] { scene.check(); }).code() == ErrorCode::usage);
  }
}

TEST_CASE("A file that is not there is an error of files, and a folder says so") {
  CHECK(refusal([] { Scene::read("no_such_scene.toml"); }).code() == ErrorCode::io);
  CHECK(has(refusal([] { Scene::read("/tmp"); }).what(), "folder"));
  CHECK(has(refusal([] { Scene::parse("a = ", "mine.toml"); }).where(), "mine.toml:1:"));
}

}  // namespace firn::test::scene
