// SPDX-License-Identifier: MIT
// The scenes that come with firn: they all read and build in both sizes, and keep what the README says of
// them.
#include <algorithm>
#include <filesystem>

#include "tests/catch.h"
#include "tests/scene/read_text.h"

namespace firn::test::scenes {
namespace {

SceneConfig read_file(const std::string& name, bool quick) {
  return read_scene(FIRN_SOURCE_ROOT "/scenes/" + name + ".toml", {quick, {}});
}

std::size_t particles(const SolverSetup& setup) {
  std::size_t count = 0;
  for (const PlacedSnow& snow : setup.snow) count += snow.position.size();
  return count;
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(FIRN_SOURCE_ROOT "/scenes")) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

TEST_CASE("the scenes are there, and each is named as its file") {
  for (const char* name : {"snowball_drop", "two_snowballs",    "snowball_vs_sheet", "snowball_into_sheet",
                           "falling_sheet", "avalanche",        "snowfall",          "broken_snowball_2d",
                           "boot_print",    "plough",           "column_collapse",   "rolling_ball",
                           "slab_release",  "powder_and_crust", "cornell_box",       "snowball_in_sun",
                           "powder_in_sun", "snow_cave",        "snowfall_at_fence", "snowball_on_drift"}) {
    CHECK(read_file(name, false).name == name);
  }
}

TEST_CASE("every scene reads, resolves and builds in its full and its quick size") {
  for (const std::string& name : scene_names()) {
    INFO(name);
    const SceneConfig full = read_file(name, false), quick = read_file(name, true);
    const std::size_t many = particles(build_simulation(full)), few = particles(build_simulation(quick));
    CHECK(few < many);
    CHECK(few <= 50000);
    CHECK(many <= 1000000);
    CHECK(build_render(full).snow.size() == full.snow.size());
    CHECK_FALSE(build_render(quick).lights.empty());
    const std::string resolved = resolved_toml(quick);
    CHECK(resolved_toml(test::read(resolved)) == resolved);
  }
}

TEST_CASE("two_snowballs has the sizes that are promised") {
  const SceneConfig full = read_file("two_snowballs", false), quick = read_file("two_snowballs", true);
  CHECK(particles(build_simulation(full)) >= 200000);
  CHECK(full.image.width == 960);
  CHECK(full.image.height == 540);
  CHECK(full.time.frames >= 60);
  CHECK(particles(build_simulation(quick)) >= 40000);
  CHECK(quick.image.width == 640);
  CHECK(quick.image.height == 360);
  CHECK(quick.time.frames == 24);
}

TEST_CASE("avalanche is of at least 300,000 particles in a domain that is turned by the slope's angle") {
  const SceneConfig scene = read_file("avalanche", false);
  CHECK(particles(build_simulation(scene)) >= 300000);
  const Vec3 along = scene.colliders[0].shape.normal->normalized();
  CHECK(std::acos(along.y()) * 180 / M_PI ==
        Approx(std::abs(scene.simulation.domain_rotation.z())).epsilon(1e-6));
}

TEST_CASE("the balls of two_snowballs are in contact by frame 8 of the quick size") {
  const SceneConfig scene = read_file("two_snowballs", true);
  const double time = 8 * scene.time.speed / scene.time.fps;
  const SnowConfig &a = scene.snow[0], &b = scene.snow[1];
  const Vec3 apart = (*a.shape.center + a.velocity * time) - (*b.shape.center + b.velocity * time);
  CHECK(apart.norm() < *a.shape.radius + *b.shape.radius - 2 * grid_spacing(scene));
}

TEST_CASE("the slice of broken_snowball_2d is one cell thick and lies between its walls") {
  for (bool quick : {false, true}) {
    const SceneConfig scene = read_file("broken_snowball_2d", quick);
    CHECK(*scene.snow[0].shape.height == Approx(grid_spacing(scene)));
    CHECK(std::abs(scene.colliders[1].shape.point->z()) == Approx(0.5 * grid_spacing(scene)));
    CHECK(scene.colliders[1].contact == Contact::slip);
  }
}

TEST_CASE("the parts of the boot of boot_print keep together") {
  const SolverSetup setup = build_simulation(read_file("boot_print", true));
  const Collider& sole = setup.colliders[1];
  for (std::size_t i = 2; i < setup.colliders.size(); ++i) {
    const Collider& part = setup.colliders[i];
    for (double time = 0; time < 2; time += 0.05) {
      INFO(part.name << " at " << time);
      const Pose a = sole.motion.pose(sole.shape.pose, time), b = part.motion.pose(part.shape.pose, time);
      const Vec3 seen = a.rotation.transpose() * (b.translation - a.translation);
      CHECK((seen - (part.shape.pose.translation - sole.shape.pose.translation)).norm() < 1e-9);
    }
  }
}

}  // namespace firn::test::scenes
