// SPDX-License-Identifier: MIT
// Snow made of a file's points: where it is, how large its particles are, what it may overlap.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/geometry/point_cloud.h"
#include "src/scene/place_points.h"
#include "tests/catch.h"
#include "tests/scene/point_files.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"
#include "tests/scene/temporary_folder.h"

namespace firn::test::points {
namespace {

double random(int i, int k) { return uniform_double(hash_keys(7, i, k)); }

// A cube of n points an axis, `step` (m) apart, each off its place by up to `jitter` steps.
std::vector<Vec3> lattice(int n, double step, double jitter = 0, const Vec3& corner = Vec3::Zero()) {
  std::vector<Vec3> points;
  for (int i = 0; i < n * n * n; ++i) {
    const Vec3 off(random(i, 0) - 0.5, random(i, 1) - 0.5, random(i, 2) - 0.5);
    points.push_back(corner +
                     step * (Vec3(i % n + 0.5, i / n % n + 0.5, i / n / n + 0.5) + 2 * jitter * off));
  }
  return points;
}

std::vector<Vec3> at_random(int count) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(random(i, 0), random(i, 1), random(i, 2));
  return points;
}

double volume_in(const std::vector<Vec3>& points) { return volume_of_point(PointTree(points)); }

std::string array_of(const std::vector<Vec3>& points) {
  std::string bytes;
  for (const Vec3& p : points) {
    for (const double x : p) put(bytes, x);
  }
  return npy("<f8", "(" + std::to_string(points.size()) + ", 3)", bytes);
}

std::string numbers_of(const std::vector<double>& values) {
  return npy("<f8", "(" + std::to_string(values.size()) + ",)", raw(values));
}

using Members = std::vector<std::pair<std::string, std::string>>;

// A scene of one archive as snow, with more keys of that snow and more tables.
struct Files {
  TemporaryFolder folder;

  SceneConfig scene(const Members& members, const std::string& keys = "", const std::string& more = "") {
    return test::read("[[snow]]\nname = \"p\"\nshape = \"particles\"\nfile = \"" +
                      folder.write("p.npz", zip(members)) + "\"\n" + keys + more);
  }
  PlacedSnow snow(const Members& members, const std::string& keys = "") {
    return build_simulation(scene(members, keys)).snow.at(0);
  }
};

}  // namespace

TEST_CASE("The nearest neighbours of a tree are those of a search over all points") {
  std::vector<Vec3> points = at_random(700);
  for (int i = 0; i < 100; ++i) points.push_back(points[static_cast<std::size_t>(i % 7)]);
  points.emplace_back(1e9, 0, 0);
  const PointTree tree(points);
  for (int k = 0; k < 50; ++k) {
    const Vec3 p = 1.4 * Vec3(random(k, 5), random(k, 6), random(k, 7));
    std::vector<double> distances;
    for (const Vec3& q : points) distances.push_back((q - p).squaredNorm());
    std::sort(distances.begin(), distances.end());
    const auto found = tree.nearest(p, 30);
    REQUIRE(found.size() == 30);
    for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i].distance2 == distances[i]);
    CHECK(tree.distance(p) == std::sqrt(distances[0]));
  }
  CHECK(tree.nearest(Vec3::Zero(), 1000).size() == points.size());
  CHECK(tree.nearest(Vec3::Zero(), 0).empty());
  CHECK(std::isinf(PointTree({}).distance(Vec3::Zero())));
}

TEST_CASE("The volume of a point is that of a lattice's cell, jittered or not, and of random points") {
  CHECK(volume_in(lattice(20, 0.01)) == Approx(1e-6).epsilon(0.01));
  CHECK(volume_in(lattice(20, 0.01, 0.25)) == Approx(1e-6).epsilon(0.03));
  CHECK(volume_in(lattice(20, 0.01, 0.5)) == Approx(1e-6).epsilon(0.03));
  CHECK(volume_in(at_random(20000)) == Approx(1.0 / 20000).epsilon(0.04));
  // Most of these are at a surface.
  CHECK(volume_in(lattice(6, 0.01)) == Approx(1e-6).epsilon(0.15));
  CHECK(volume_in(lattice(4, 0.01)) == Approx(1e-6).epsilon(0.3));
  CHECK(volume_in(lattice(2, 0.01)) == Approx(1e-6).epsilon(1e-9));
  // Far from 0 and with one that has gone astray.
  std::vector<Vec3> far = lattice(20, 0.01, 0, Vec3(4e5, 100, 5e6));
  far.emplace_back(0, 0, 0);
  CHECK(volume_in(far) == Approx(1e-6).epsilon(0.01));
  CHECK(volume_in({Vec3::Zero()}) == 0);
  CHECK(volume_in(std::vector<Vec3>(100, Vec3::Ones())) == 0);
  CHECK(volume_in({}) == 0);
}

TEST_CASE(
    "Points are scaled, turned, then moved, and so are their velocities and strains, without the move") {
  Files files;
  const std::string f = npy("<f8", "(1, 3, 3)", raw(std::vector<double>{1.1, 0.2, 0, 0, 1, 0, 0, 0, 1}));
  const PlacedSnow snow = files.snow(
      {{"x.npy", array_of({Vec3(1, 2, 3)})}, {"v.npy", array_of({Vec3(4, 5, 6)})}, {"F.npy", f}},
      "scale = 0.5\nrotation = [0, 0, 90]\noffset = [10, 20, 30]\nvelocity = [0, 0, 1]\nspacing = 0.1\n");
  CHECK((snow.position[0] - Vec3(9, 20.5, 31.5)).norm() < 1e-12);
  CHECK((snow.velocity[0] - Vec3(-2.5, 2, 4)).norm() < 1e-12);
  CHECK(snow.particle_volume == Approx(1e-3));
  CHECK(snow.strain[0](1, 1) == Approx(1.1));
  CHECK(snow.strain[0](1, 0) == Approx(-0.2));
}

TEST_CASE("Far places stay exact to the last bit when an offset brings them to the origin") {
  Files files;
  std::vector<Vec3> map = lattice(4, 0.25);
  for (Vec3& p : map) p += Vec3(4e5, 1000, 5e6);
  const PlacedSnow snow = files.snow({{"x.npy", array_of(map)}}, "offset = [-400000, -1000, -5000000]\n");
  const std::vector<Vec3> near = lattice(4, 0.25);
  CHECK(snow.position == near);
  CHECK_REFUSES(build_simulation(files.scene({{"x.npy", array_of(map)}})),
                "move them, as with offset = [-400000, 0, -5000000]");
}

TEST_CASE("A spin turns points about the middle of their bounds") {
  Files files;
  const PlacedSnow snow =
      files.snow({{"x.npy", array_of({Vec3(1, 0, 0), Vec3(3, 0, 0)})}}, "spin = [0, 0, 2]\n");
  CHECK((snow.velocity[0] - Vec3(0, -2, 0)).norm() < 1e-12);
  CHECK((snow.velocity[1] - Vec3(0, 2, 0)).norm() < 1e-12);
}

TEST_CASE(
    "Volumes are those of the spacing, or else the file's volume, mass, radius, or the points' distance") {
  Files files;
  const auto place = std::pair{std::string("x.npy"), array_of(lattice(2, 0.1))};
  const auto column = [](const char* name, double first) {
    return std::pair{std::string(name), numbers_of({first, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3})};
  };
  const auto volume = column("volume.npy", 2e-3), mass = column("mass.npy", 2e-3),
             radius = column("radius.npy", 2e-3);
  CHECK(files.snow({place, volume}, "spacing = 0.2\n").particle_volume == Approx(8e-3));
  const PlacedSnow by_volume = files.snow({place, volume, mass, radius}, "scale = 2.0\n");
  CHECK(by_volume.volume_of(0) == Approx(16e-3));
  CHECK(by_volume.particle_volume == Approx(9e-3));
  CHECK(files.snow({place, mass, radius}, "density = 200.0\n").volume_of(0) == Approx(1e-5));
  CHECK(files.snow({place, radius}, "scale = 10.0\n").volume_of(1) == Approx(8e-6));
  const PlacedSnow by_distance = files.snow({place});
  CHECK(by_distance.volume.empty());
  CHECK(by_distance.particle_volume == Approx(1e-3));
  CHECK(files.snow({place, column("volume.npy", 1e-3)}).volume.empty());
}

TEST_CASE("One point, or many at one place, need a spacing") {
  Files files;
  CHECK_REFUSES(
      build_simulation(files.scene({{"x.npy", array_of({Vec3(0, 0, 0)})}, {"m.npy", numbers_of({1e33})}},
                                   "density = 1e-3\n")),
      "point 0, counted from 0, stands for 1e+36 m3, which single precision cannot");
  const Members one = {{"x.npy", array_of({Vec3(1, 2, 3)})}};
  CHECK_REFUSES(build_simulation(files.scene(one)), "scene.toml:4:1: the file's one point does not tell");
  CHECK(files.snow(one, "spacing = 0.01\n").particle_volume == Approx(1e-6));
  const Members many = {{"x.npy", array_of(std::vector<Vec3>(50, Vec3(1, 2, 3)))}};
  CHECK_REFUSES(build_simulation(files.scene(many)), "lie at the same place");
}

TEST_CASE("The packing is the file's Jp, or that which makes the snow as dense as the file says") {
  Files files;
  const auto place = std::pair{std::string("x.npy"), array_of({Vec3::Zero(), Vec3::Ones()})};
  const std::pair<std::string, std::string> packed{"Jp.npy", numbers_of({0.8, 1.25})},
      dense{"density.npy", numbers_of({500, 320})};
  const std::vector<float> expected = {0.8f, 1.25f};
  CHECK(files.snow({place, packed}, "density = 400.0\n").packing == expected);
  CHECK(files.snow({place, dense}, "density = 400.0\n").packing == expected);
  CHECK_REFUSES(build_simulation(files.scene({place, {"Jp.npy", numbers_of({1, 1e-3})}})),
                "scene.toml:4:1: point 1, counted from 0, has Jp = 0.001, outside of this snow's jp_min");
  CHECK_REFUSES(build_simulation(files.scene({place, {"density.npy", numbers_of({1, 400})}})),
                "by its density");
  const PlacedSnow loose = files.snow({place, packed}, "looseness = 0.5\nclump_size = 1.0\n");
  CHECK((loose.packing[0] >= 0.8f && loose.packing[0] <= 1.21f));
}

TEST_CASE("Without dx the grid has as many points a cell as particles_per_cell says") {
  Files files;
  const Members cube = {{"x.npy", array_of(lattice(10, 0.01))}};
  const std::string ball = "[[snow]]\nshape = \"ball\"\ncenter = [1, 1, 1]\nradius = 0.1\n";
  CHECK(grid_spacing(files.scene(cube, "spacing = 0.01\n")) == Approx(0.02));
  CHECK(grid_spacing(files.scene(cube, "spacing = 0.01\nparticles_per_cell = 27\n", ball)) == Approx(0.03));
  CHECK(grid_spacing(files.scene(cube, "", "[simulation]\ndx = 0.5\n")) == 0.5);
}

TEST_CASE("Points with volumes of their own have the mass and the strain that they were placed with") {
  Files files;
  std::vector<double> volumes, strain;
  for (int i = 0; i < 64; ++i) {
    volumes.push_back(1e-6 * (1 + 0.01 * i));
    strain.insert(strain.end(), {0.99, 0, 0, 0, 1, 0, 0, 0, 1});
  }
  const SceneConfig scene = files.scene({{"x.npy", array_of(lattice(4, 0.01, 0, Vec3(0.1, 0.2, 0.3)))},
                                         {"volume.npy", numbers_of(volumes)},
                                         {"F.npy", npy("<f8", "(64, 3, 3)", raw(strain))}},
                                        "",
                                        "[simulation]\ndomain_min = [-1, -1, -1]\ndomain_max = [1, 1, 1]\n"
                                        "domain_rotation = [0, 0, 90]\n");
  const Solver simulation(choose_kernels("base"), build_simulation(scene));
  const Metrics metrics = simulation.metrics();
  CHECK(metrics.mass == Approx(64e-6 * (1 + 0.01 * 31.5) * scene.snow[0].material.density).epsilon(1e-6));
  CHECK(metrics.volume == Approx(0.99 * 64e-6 * (1 + 0.01 * 31.5)).epsilon(1e-5));
  CHECK(metrics.elastic_energy > 0);
  Snapshot snapshot;
  simulation.snapshot(snapshot);
  for (std::size_t i = 0; i < snapshot.size(); ++i)
    CHECK(snapshot.volume0[i] == Approx(volumes[snapshot.id[i]]).epsilon(1e-5));
}

TEST_CASE("Points overlap other snow and colliders, whichever stands first, and are trimmed") {
  Files files;
  std::vector<double> volumes(1000, 1e-6);
  volumes[999] = 2e-6;
  const Members cube = {{"x.npy", array_of(lattice(10, 0.01))}, {"volume.npy", numbers_of(volumes)}};
  const auto ball = [](double x, const std::string& keys = "") {
    return "[[snow]]\nname = \"b\"\nshape = \"ball\"\ncenter = [" + std::to_string(x) +
           ", 0.05, 0.05]\nradius = 0.03\n" + keys;
  };
  CHECK_NOTHROW(build_simulation(files.scene(cube, "", ball(0.14))));
  CHECK_REFUSES(build_simulation(files.scene(cube, "", ball(0.1))), "snow 'b' starts inside snow 'p'");
  CHECK_NOTHROW(build_simulation(files.scene(cube, "allow_overlap = true\n", ball(0.1))));
  SceneConfig turned = files.scene(cube, "", ball(0.1));
  std::swap(turned.snow[0], turned.snow[1]);
  CHECK_REFUSES(build_simulation(turned), "snow 'p' starts inside snow 'b'");
  CHECK_REFUSES(build_simulation(files.scene(cube, "", "[ground]\nheight = 0.05\n")),
                "starts inside the ground");

  const SolverSetup half = build_simulation(files.scene(cube, "trim = true\n", "[ground]\nheight = 0.05\n"));
  CHECK(half.snow[0].position.size() == 500);
  CHECK(half.snow[0].volume.size() == 500);
  CHECK(half.snow[0].particle_volume == Approx(1e-6 * 501 / 500));
  const SolverSetup around = build_simulation(files.scene(cube, "", ball(0.1, "trim = true\n")));
  for (const Vec3& p : around.snow[1].position) CHECK(p.x() > 0.095);
  CHECK(around.snow[1].position.size() > 20);
  // Two files in the same place.
  SceneConfig twice = files.scene(cube);
  twice.snow.push_back(twice.snow[0]);
  twice.snow[1].name = "q";
  CHECK_REFUSES(build_simulation(twice), "snow 'q' starts inside snow 'p' (1000 particles)");
  twice.snow[1].shape.offset = Vec3(0.1, 0, 0);
  CHECK_NOTHROW(build_simulation(twice));
}

TEST_CASE("Keys of other shapes are refused for points, and points for what is no snow") {
  const std::string head = "[[snow]]\nshape = \"particles\"\n";
  CHECK_REFUSES(test::read(head), "scene.toml:1:1: [[snow]] lacks 'file'");
  CHECK_REFUSES(test::read(head + "file = \"a\"\nradius = 1.0\n"), "'radius' belongs to shape = ball");
  CHECK_REFUSES(test::read(kBall + "spacing = 1.0\n"), "'spacing' belongs to shape = particles");
  CHECK_REFUSES(test::read(head + "file = \"none.npz\"\n"), "no such file");
  CHECK_REFUSES(test::read(kBall + "[[collider]]\nshape = \"particles\"\nfile = \"a\"\n"),
                "'shape': expected one of");
}

}  // namespace firn::test::points
