// SPDX-License-Identifier: MIT
// Points of a program as snow: as arrays, and as the files that are made of them.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "firn/firn.h"
#include "tests/catch.h"
#include "tests/library/folder.h"
#include "tests/library/refusal.h"
#include "tests/library/small_scenes.h"

namespace firn::test::points {
namespace {

using Catch::Matchers::Contains;

constexpr double kSpacing = 0.01;  // m

// A ball of points on a lattice.
Points ball_of_points(double radius = 0.05, double height = 0.2) {
  Points points;
  for (double x = -radius; x <= radius; x += kSpacing) {
    for (double y = -radius; y <= radius; y += kSpacing) {
      for (double z = -radius; z <= radius; z += kSpacing) {
        if (std::hypot(x, y, z) < radius) points.position.push_back({x, y + height, z});
      }
    }
  }
  points.volume = {std::pow(kSpacing, 3)};
  return points;
}

// With a value of its own for every point and column.
Points uneven_points() {
  Points points = ball_of_points();
  const std::size_t count = points.position.size();
  points.volume.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const double wave = std::sin(static_cast<double>(i));
    points.velocity.push_back({0.1 * wave, -2, 0.2 * wave});
    points.volume.push_back(1e-6 * (1 + 0.1 * wave));
    points.Jp.push_back(1 + 0.001 * wave);
    points.F.push_back({1 + 0.001 * wave, 0.002 * wave, 0, 0, 1, 0, 0, 0, 1});
  }
  return points;
}

Scene grounded() {
  Scene scene("points");
  return scene.set("ground.friction", 0.5).set("simulation.dx", 0.02);
}

std::uint64_t hash_at(const Scene& scene, double time, int threads = 2) {
  Simulation simulation(scene, on(threads));
  simulation.advance_to(time);
  return simulation.hash();
}

const Table kTurned = {{"rotation", {10, 20, 30}}, {"offset", {0.1, 0.05, 0}}, {"spin", {0, 5, 0}}};

}  // namespace

TEST_CASE("arrays are the snow that a file of them is, bit for bit") {
  for (const Points& points : {ball_of_points(), uneven_points()}) {
    for (const Table& keys : {Table{}, kTurned}) {
      const Folder folder;
      write_points(points, folder / "p.npz");
      Scene of_file = grounded();
      Table with_file = keys;
      with_file.push_back({"shape", "particles"});
      with_file.push_back({"file", folder / "p.npz"});
      of_file.add("snow", with_file);
      Scene of_arrays = grounded();
      of_arrays.add_points(points, keys);
      const std::uint64_t hash = hash_at(of_file, 0.03);
      CHECK(hash_at(of_arrays, 0.03) == hash);
      CHECK(hash_at(of_arrays, 0.03, 1) == hash);
      const Scene copy = of_arrays;
      CHECK(hash_at(copy, 0.03, 3) == hash);
    }
  }
}

TEST_CASE("points are read back as they were written") {
  const Folder folder;
  Points points = uneven_points();
  for (Matrix3& f : points.F) {
    for (double& x : f) x = static_cast<double>(static_cast<float>(x));
  }
  points.mass = std::vector<double>(points.position.size(), 1e-4);
  points.radius = std::vector<double>(points.position.size(), 0.005);
  write_points(points, folder / "p.npz");
  const Points again = read_points(folder / "p.npz");
  CHECK(again.position == points.position);
  CHECK(again.velocity == points.velocity);
  CHECK(again.volume == points.volume);
  CHECK(again.mass == points.mass);
  CHECK(again.radius == points.radius);
  CHECK(again.density.empty());
  CHECK(again.Jp == points.Jp);
  CHECK(again.F == points.F);
  CHECK(refusal([&] { read_points(folder / "none.npz"); }).code() == ErrorCode::io);
  CHECK(refusal([&] { write_points(points, folder / "none/p.npz"); }).code() == ErrorCode::io);
}

TEST_CASE("points that cannot be snow are refused at the line that gives them") {
  Scene scene = grounded();
  const auto refused = [&](const Points& points, const Table& keys = {}) {
    const Error error = refusal([&] { scene.add_points(points, keys); });
    CHECK(error.code() == ErrorCode::usage);
    CHECK_THAT(error.what(), Contains("test_points.cpp:"));
    return std::string(error.what());
  };
  CHECK_THAT(refused({}), Contains("no points"));
  Points bad = ball_of_points();
  bad.position[4][1] = NAN;
  CHECK_THAT(refused(bad), Contains("point 4"));
  bad = ball_of_points();
  bad.velocity.resize(3);
  CHECK_THAT(refused(bad), Contains("'velocity' has 3 entries"));
  bad = ball_of_points();
  bad.volume = {1e-6, 1e-6};
  CHECK_THAT(refused(bad), Contains("'volume' has 2 entries") && Contains("one for all"));
  bad.volume = {0};
  CHECK_THAT(refused(bad), Contains("volume"));
  bad = ball_of_points();
  bad.F.resize(1, kIdentity3);
  CHECK_THAT(refused(bad), Contains("'F' has 1 entries"));
  CHECK_THAT(refused(ball_of_points(), {{"file", "a.npz"}}), Contains("'file' is given twice"));
  CHECK_THAT(refused(ball_of_points(), {{"shape", "ball"}}), Contains("'shape' is given twice"));
  // What was refused has left nothing behind.
  scene.add_points(ball_of_points());
  CHECK_NOTHROW(scene.check());
  CHECK(Simulation(scene).size() == ball_of_points().position.size());
}

TEST_CASE("points come into a simulation that is under way") {
  Simulation simulation(bed());
  simulation.advance_to(0.01);
  const std::size_t before = simulation.size();
  CHECK(simulation.add_points(ball_of_points(), {{"name", "ball"}, {"velocity", {0, -2, 0}}}) == 1);
  CHECK(simulation.size() == before + ball_of_points().position.size());
  const std::uint64_t hash = simulation.hash();
  const Error error = refusal([&] { simulation.add_points(ball_of_points()); });
  CHECK_THAT(error.what(), Contains("start inside snow"));
  CHECK(simulation.hash() == hash);
  simulation.advance_to(0.05);
}

TEST_CASE("a saved state has its arrays with it") {
  Scene scene = grounded();
  scene.add_points(uneven_points());
  scene.add("snow", {{"shape", "box"}, {"size", {0.1, 0.1, 0.1}}, {"center", {0.4, 0.05, 0}}});
  Simulation simulation(scene);
  simulation.advance_to(0.02);
  simulation.add_points(ball_of_points(), {{"offset", {-0.3, 0, 0}}});
  std::ostringstream out;
  simulation.save(out);
  simulation.advance_to(0.05);
  std::istringstream in(out.str());
  Simulation again = Simulation::load(in);
  std::ostringstream twice;
  again.save(twice);
  CHECK(twice.str() == out.str());
  again.add_points(ball_of_points(0.03), {{"offset", {0.8, 0, 0}}});
  simulation.add_points(ball_of_points(0.03), {{"offset", {0.8, 0, 0}}});
  again.advance_to(0.05);
  CHECK(again.size() == simulation.size());
  for (const std::size_t byte : {out.str().size() - 20, out.str().size() / 2, out.str().size() - 3}) {
    std::string damaged = out.str();
    damaged[byte] = static_cast<char>(damaged[byte] ^ 1);
    std::istringstream from(damaged);
    CHECK(refusal([&] { Simulation::load(from); }).code() == ErrorCode::io);
  }
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{30}, out.str().size() - 1}) {
    std::istringstream from(out.str().substr(0, bytes));
    CHECK(refusal([&] { Simulation::load(from); }).code() == ErrorCode::io);
  }
}

TEST_CASE("a run folder and a scene as text need a file") {
  Scene scene = grounded();
  scene.add_points(ball_of_points(), {{"name", "grains"}});
  const Folder folder;
  SessionOptions options;
  options.out = folder / "run";
  const Error error = refusal([&] { Session::start(scene, options); });
  CHECK_THAT(error.what(), Contains("'grains' is made of arrays") && Contains("write_points"));
  CHECK_FALSE(std::filesystem::exists(folder / "run"));
  const Scene text = Scene::parse(scene.toml());
  CHECK_THAT(refusal([&] { Simulation simulation(text); }).what(), Contains("were arrays of the program"));
}

}  // namespace firn::test::points
