// SPDX-License-Identifier: MIT
// What a scene will take and show, as programs of others learn it before they run it.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/refusal.h"
#include "tests/library/small_scenes.h"

namespace firn::test::check {
namespace {

constexpr double kRadius = 0.1;  // m

// Small pictures of a ground.
Scene stage(bool ground = true) {
  Scene scene("stage");
  scene.set("simulation.dx", 0.025).set("time.frames", 5).set("time.fps", 25);
  scene.set("image.width", 64).set("image.height", 48).set("image.samples", 3).set("image.max_bounces", 7);
  scene.set("camera.position", {0, 0.6, 2}).set("camera.target", {0, 0.1, 0});
  if (ground) scene.set("ground.friction", 0.5);
  return scene;
}

Table ball(const std::string& name, const Vector3& center) {
  return {
      {"name", name}, {"shape", "ball"}, {"radius", kRadius}, {"center", {center[0], center[1], center[2]}}};
}

Table with(Table keys, const std::string& name, const Value& value) {
  keys.push_back({name, value});
  return keys;
}

std::vector<SceneWarning> of_kind(const CheckReport& report, WarningKind kind) {
  std::vector<SceneWarning> warnings;
  std::copy_if(report.warnings.begin(), report.warnings.end(), std::back_inserter(warnings),
               [&](const SceneWarning& warning) { return warning.kind == kind; });
  return warnings;
}

// A cube of points, 0.02 m from one to the next, in a file that is removed at the end.
class CubeOfPoints {
 public:
  static constexpr double kStep = 0.02;  // m
  static constexpr int kAcross = 10;

  CubeOfPoints() : path_(std::filesystem::temp_directory_path() / "firn_test_check.ply") {
    std::ofstream out(path_);
    out << "ply\nformat ascii 1.0\nelement vertex 1000\nproperty double x\nproperty double y\n"
           "property double z\nend_header\n";
    for (int i = 0; i < 1000; ++i)
      out << kStep * (i % kAcross) << ' ' << kStep * (i / kAcross % kAcross) << ' '
          << kStep * (i / kAcross / kAcross) << '\n';
  }
  ~CubeOfPoints() { std::filesystem::remove(path_); }
  Table keys() const { return {{"shape", "particles"}, {"file", path_.string()}}; }

 private:
  std::filesystem::path path_;
};

}  // namespace

TEST_CASE("A report weighs each body as its density and its shape do") {
  Scene scene = stage();
  const double density = GENERATE(250., 400.);
  scene.add("snow", with(ball("left", {-0.3, kRadius, 0}), "density", density));
  scene.add("snow", {{"name", "right"},
                     {"shape", "box"},
                     {"size", {0.2, 0.1, 0.3}},
                     {"center", {0.3, 0.05, 0}},
                     {"density", 2 * density}});
  const CheckReport report = check_scene(scene);
  REQUIRE(report.snow.size() == 2);
  const double volumes[] = {4. / 3 * std::numbers::pi * std::pow(kRadius, 3), 0.2 * 0.1 * 0.3};
  double mass = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const CheckedSnow& snow = report.snow[i];
    CHECK(snow.volume == Approx(volumes[i]).epsilon(1e-6));
    CHECK(snow.mass == Approx(density * static_cast<double>(i + 1) * volumes[i]).epsilon(1e-6));
    CHECK(snow.particle_mass * static_cast<double>(snow.particles) == Approx(snow.mass).epsilon(1e-12));
    mass += snow.mass;
  }
  CHECK(report.snow[0].name == "left");
  CHECK(report.particles == report.snow[0].particles + report.snow[1].particles);
  CHECK(report.mass == Approx(mass).epsilon(1e-12));
  const Simulation simulation(scene);
  CHECK(report.particles == simulation.size());
  CHECK(simulation.metrics().mass == Approx(mass).epsilon(1e-6));
  CHECK(report.warnings.empty());
}

TEST_CASE("A report says where each body's particles lie") {
  Scene scene = stage();
  scene.add("snow", ball("a", {-0.3, kRadius, 0.1})).add("snow", ball("b", {0.3, kRadius, 0}));
  const CheckReport report = check_scene(scene);
  const Snapshot snow = Simulation(scene).snapshot();
  for (std::size_t body = 0; body < 2; ++body) {
    Vector3 low = {1e300, 1e300, 1e300}, high = {-1e300, -1e300, -1e300};
    for (std::size_t i = 0; i < snow.size(); ++i) {
      if (snow.object[i] != body) continue;
      const Vector3 place = snow.world_position(i);
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], place[k]);
        high[k] = std::max(high[k], place[k]);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(report.snow[body].bounds_min[k] == Approx(low[k]).margin(1e-6));
      CHECK(report.snow[body].bounds_max[k] == Approx(high[k]).margin(1e-6));
    }
  }
}

TEST_CASE("A report counts the steps that frames take, and says what a run begins with") {
  Scene scene = stage();
  scene.add("snow", ball("a", {0, kRadius, 0}));
  const CheckReport report = check_scene(scene);
  CHECK(report.scene == "stage");
  CHECK(report.file == "scene");
  CHECK(report.dx == 0.025);
  CHECK((report.width == 64 && report.height == 48 && report.samples == 3 && report.max_bounces == 7));
  CHECK(report.frames == 5);
  CHECK(report.frame_seconds == Approx(scene.frame_time(1)));
  Simulation simulation(scene);
  CHECK(report.step.dt == simulation.step());
  CHECK_FALSE(report.step.cause.empty());
  CHECK_FALSE(report.fixed_dt);
  CHECK(report.shortest_dt < report.step.dt);
  CHECK(report.steps_per_frame.high == std::ceil(report.frame_seconds / report.shortest_dt));
  CHECK(report.steps.low == 4 * report.steps_per_frame.low);
  CHECK(report.steps.high == 4 * report.steps_per_frame.high);
  simulation.advance_to(scene.frame_time(1));
  CHECK(simulation.metrics().steps >= report.steps_per_frame.low);
  CHECK(simulation.metrics().steps <= report.steps_per_frame.high);
  CHECK(report.grid_blocks > 0);
}

TEST_CASE("A fixed step is what is reported, and the refusal of one that is too long") {
  Scene scene = stage();
  scene.add("snow", ball("a", {0, kRadius, 0})).set("simulation.dt", 1e-5);
  const CheckReport report = check_scene(scene);
  CHECK(report.fixed_dt);
  CHECK((report.step.dt == 1e-5 && report.shortest_dt == 1e-5));
  CHECK(report.steps_per_frame.low == 4000);
  CHECK(report.steps_per_frame.high == 4000);
  scene.set("simulation.dt", 0.1);
  CHECK(refusal([&] { check_scene(scene); }).code() == ErrorCode::usage);
  const CheckReport forced = check_scene(scene, {.force = true});
  REQUIRE(forced.blow_up);
  CHECK(forced.blow_up->code() == ErrorCode::unstable);
  CHECK(forced.steps_per_frame.low == 1);
  CHECK_FALSE(report.blow_up);
}

TEST_CASE("The memory of a report is that of the process, with a part of the simulation") {
  Scene scene = stage();
  scene.add("snow", ball("a", {0, kRadius, 0}));
  const MemoryEstimate memory = check_scene(scene).memory;
  const auto particles = static_cast<double>(Simulation(scene).size());
  CHECK(memory.at_start > memory.simulation);
  CHECK(memory.peak_low >= memory.at_start);
  CHECK(memory.peak_high > memory.peak_low);
  CHECK(memory.bytes_per_particle * particles == Approx(memory.simulation));
  CHECK(memory.bytes_per_particle > 64);
}

TEST_CASE("What a camera sees adds up to the picture, and snow behind it is unseen") {
  Scene scene = stage();
  scene.add("snow", ball("left", {-0.3, kRadius, 0})).add("snow", ball("behind", {0, kRadius, 4}));
  scene.add("snow", ball("right", {0.3, kRadius, 0}));
  const CheckReport report = check_scene(scene);
  double sum = report.background_fraction;
  for (const CheckedSnow& snow : report.snow) sum += snow.pixel_fraction;
  for (const CheckedObject& object : report.objects) sum += object.pixel_fraction;
  CHECK(sum == Approx(1));
  REQUIRE(report.objects.size() == 1);
  CHECK(report.objects[0].name == "the ground");
  CHECK(report.snow[0].pixel_fraction == Approx(report.snow[2].pixel_fraction).epsilon(0.2));
  CHECK(report.snow[1].pixel_fraction == 0);
  REQUIRE(report.warnings.size() == 1);
  CHECK(report.warnings[0].kind == WarningKind::unseen);
  CHECK(report.warnings[0].snow == 1);

  scene.set("camera.position", {0, 0.6, -2}).set("camera.target", {0, 0.6, -9});
  CHECK(of_kind(check_scene(scene), WarningKind::unseen).size() == 3);
}

TEST_CASE("Snow that nothing holds floats, unless it moves or has no weight") {
  const auto floating = [](const Table& keys, const std::function<void(Scene&)>& change = {}) {
    Scene scene = stage();
    scene.add("snow", keys);
    if (change) change(scene);
    return of_kind(check_scene(scene), WarningKind::floating).size();
  };
  const Table high = ball("a", {0, 0.4, 0});
  CHECK(floating(high) == 1);
  CHECK(floating(ball("a", {0, kRadius, 0})) == 0);
  CHECK(floating(with(high, "velocity", {1, 0, 0})) == 0);
  CHECK(floating(with(high, "terminal_velocity", 1.)) == 0);
  CHECK(floating(high, [](Scene& s) { s.set("simulation.gravity", {0, 0, 0}); }) == 0);
  CHECK(floating(high, [](Scene& s) { s.add("snow", ball("b", {0, 0.2, 0})); }) == 2);
  const Table table = {{"shape", "box"}, {"center", {0, 0.2, 0}}, {"size", {1, 0.2, 1}}};
  CHECK(floating(high, [&](Scene& s) { s.add("collider", table); }) == 0);

  Scene nothing_below = stage(false);
  nothing_below.add("snow", ball("a", {0, kRadius, 0}));
  CHECK(of_kind(check_scene(nothing_below), WarningKind::floating).size() == 1);
}

TEST_CASE("Snow in a collider or in an object is buried, and the line of the program is named") {
  const Table hill = {{"name", "hill"}, {"shape", "box"}, {"center", {0, -2, 0}}, {"size", {9, 4, 9}}};
  const Table seen = {{"shape", "box"}, {"center", {0, -2, 0}}, {"size", {9, 4, 9}}};
  for (const bool felt : {true, false}) {
    Scene scene = stage(false);
    scene.add(felt ? "collider" : "object", felt ? hill : seen);
    const int line = __LINE__ + 1;
    scene.add("snow", with(ball("deep", {0, -1, 0}), "allow_overlap", true));
    const std::vector<SceneWarning> buried = of_kind(check_scene(scene), WarningKind::buried);
    REQUIRE(buried.size() == 1);
    CHECK(buried[0].place == std::string(__FILE__) + ":" + std::to_string(line));
    CHECK(buried[0].text == std::string("100 % of snow 'deep' lies under the surface of ") +
                                (felt ? "collider 'hill'" : "object[0]"));
  }
}

TEST_CASE("Points are told from snow by a grid too fine for them, or volumes that are not theirs") {
  const CubeOfPoints cube;
  const auto kinds = [&](double dx, const Table& keys) {
    Scene scene = stage();
    scene.set("simulation.dx", dx).add("snow", with(keys, "offset", {-0.1, 0.02, -0.1}));
    const CheckReport report = check_scene(scene);
    CHECK(report.particles == 1000);
    return std::pair(of_kind(report, WarningKind::sparse_points).size(),
                     of_kind(report, WarningKind::odd_points).size());
  };
  const double step = CubeOfPoints::kStep;
  CHECK(kinds(2 * step, cube.keys()) == std::pair<std::size_t, std::size_t>(0, 0));
  CHECK(kinds(0.5 * step, cube.keys()) == std::pair<std::size_t, std::size_t>(1, 0));
  CHECK(kinds(2 * step, with(cube.keys(), "spacing", 0.1 * step)).second == 1);
  CHECK(kinds(6 * step, with(cube.keys(), "spacing", 3 * step)) == std::pair<std::size_t, std::size_t>(0, 1));
}

TEST_CASE("A report has every warning, however many there are of a kind") {
  for (const int count : {10, 11, 25}) {
    Scene scene = stage();
    for (int i = 0; i < count; ++i) scene.add("snow", ball("s" + std::to_string(i), {0.3 * i, 0.5, 5}));
    const CheckReport report = check_scene(scene);
    for (const WarningKind kind : {WarningKind::floating, WarningKind::unseen}) {
      const std::vector<SceneWarning> warnings = of_kind(report, kind);
      REQUIRE(warnings.size() == static_cast<std::size_t>(count));
      for (std::size_t i = 0; i < warnings.size(); ++i) CHECK(warnings[i].snow == i);
    }
    CHECK(report.warnings.size() == static_cast<std::size_t>(2 * count));
  }
}

TEST_CASE("A report of a file names its lines") {
  const std::string text =
      "[simulation]\ndx = 0.025\n[ground]\n\n[[snow]]\nshape = \"ball\"\nradius = 0.1\n"
      "center = [0, 0.4, 0]\n";
  const std::vector<SceneWarning> warnings =
      of_kind(check_scene(Scene::parse(text, "a.toml")), WarningKind::floating);
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].place == "a.toml:5:1");
  CHECK(warnings[0].text.find("snow 'snow0' floats") == 0);
}

TEST_CASE("A report is the same for one thread and for two, but for its memory") {
  Scene scene = stage();
  for (const double x : {-0.3, 0.3}) scene.add("snow", ball(x < 0 ? "a" : "b", {x, 0.3, 0}));
  const CheckReport one = check_scene(scene, {.threads = 1}), two = check_scene(scene, {.threads = 2});
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(one.snow[i].particles == two.snow[i].particles);
    CHECK(one.snow[i].mass == two.snow[i].mass);
    CHECK(one.snow[i].bounds_min == two.snow[i].bounds_min);
    CHECK(one.snow[i].pixel_fraction == two.snow[i].pixel_fraction);
  }
  CHECK(one.step.dt == two.step.dt);
  CHECK(one.step.cause == two.step.cause);
  CHECK(one.steps.high == two.steps.high);
  CHECK(one.grid_blocks == two.grid_blocks);
  CHECK(one.background_fraction == two.background_fraction);
  REQUIRE(one.warnings.size() == two.warnings.size());
  for (std::size_t i = 0; i < one.warnings.size(); ++i) CHECK(one.warnings[i].text == two.warnings[i].text);
}

TEST_CASE("What a run refuses a check refuses") {
  CHECK(refusal([] { check_scene(stage()); }).code() == ErrorCode::usage);  // no snow
  Scene scene = stage();
  scene.add("snow", with(ball("a", {0, kRadius, 0}), "density", -1.));
  CHECK(refusal([&] { check_scene(scene); }).where().find("test_check.cpp") != std::string::npos);
  scene = stage().add("snow", ball("a", {0, kRadius, 0}));
  CHECK(refusal([&] { check_scene(scene, {.isa = "mmx"}); }).code() == ErrorCode::usage);
  scene.add("object", {{"shape", "mesh"}, {"file", "nowhere.obj"}});
  CHECK(refusal([&] { check_scene(scene); }).code() == ErrorCode::io);
}

}  // namespace firn::test::check
