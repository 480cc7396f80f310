// SPDX-License-Identifier: MIT
// Particles: uniform in volume, never clumped, as many as the cells ask for, with the mass of density times
// volume.
#include "src/scene/emit.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "src/scene/clumps.h"
#include "tests/catch.h"
#include "tests/scene/read_text.h"
#include "tests/scene/refuses.h"

namespace firn::test::emit {

namespace {

double least_distance(const std::vector<Vec3>& points, double cell) {
  std::map<std::array<long, 3>, std::vector<Vec3>> cells;
  const auto cell_of = [cell](const Vec3& p) {
    return std::array<long, 3>{std::lround(std::floor(p.x() / cell)), std::lround(std::floor(p.y() / cell)),
                               std::lround(std::floor(p.z() / cell))};
  };
  double least = 1e300;
  for (const Vec3& p : points) {
    const auto home = cell_of(p);
    for (long n = 0; n < 27; ++n) {
      const auto found = cells.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
      if (found == cells.end()) continue;
      for (const Vec3& q : found->second) least = std::min(least, (p - q).norm());
    }
    cells[home].push_back(p);
  }
  return least;
}

const Shape kBall{Ball{1.0}, {Mat3::Identity(), Vec3(3, -2, 5)}};

SolverSetup build(const std::string& text) { return build_simulation(read(text)); }

double total_mass(const PlacedSnow& snow) {
  return snow.particle_mass() * static_cast<double>(snow.position.size());
}

}  // namespace

TEST_CASE("a ball is filled uniformly in volume: shells and octants hold their share") {
  const auto points = fill_shape(kBall, 0.05, 1);
  const double count = static_cast<double>(points.size());
  std::vector<double> shells(8), octants(8);
  Vec3 mean = Vec3::Zero();
  double square = 0;
  for (const Vec3& p : points) {
    const Vec3 d = p - kBall.pose.translation;
    CHECK(d.norm() < 1);
    ++shells[static_cast<int>(8 * std::pow(d.norm(), 3))];
    ++octants[(d.x() < 0) + 2 * (d.y() < 0) + 4 * (d.z() < 0)];
    mean += d / count;
    square += d.squaredNorm() / count;
  }
  // Chi squared with 7 degrees of freedom exceeds 24.3 once in 1000 times for independent points; a lattice
  // is evener.
  double chi_shells = 0, chi_octants = 0;
  for (int i = 0; i < 8; ++i) {
    chi_shells += std::pow(shells[i] - count / 8, 2) / (count / 8);
    chi_octants += std::pow(octants[i] - count / 8, 2) / (count / 8);
  }
  CHECK(chi_shells < 24.3);
  CHECK(chi_octants < 24.3);
  CHECK(mean.norm() < 0.003);
  CHECK(square == Approx(0.6).epsilon(0.005));  // the mean of r^2 over a ball
}

TEST_CASE("no two particles are nearer than half the spacing") {
  for (const Shape& shape : {kBall, Shape{Box{Vec3(0.5, 0.1, 0.7)}, {}}}) {
    const auto points = fill_shape(shape, 0.05, 2);
    CHECK(least_distance(points, 0.05) > 0.5 * 0.05 * 0.9);  // the lattice may be pressed by a tenth to fit
  }
}

TEST_CASE("the jitter is no lattice: neighbours in a row are not on a line") {
  const auto points = fill_shape({Box{Vec3::Constant(0.5)}, {}}, 0.1, 3);
  double square = 0;
  for (const Vec3& p : points) square += std::pow(p.y() * 10 - std::floor(p.y() * 10) - 0.5, 2);
  CHECK(std::sqrt(square / static_cast<double>(points.size())) == Approx(0.25 / std::sqrt(3.0)).epsilon(0.1));
}

TEST_CASE(
    "there are as many particles as particles_per_cell asks for, and their mass is density times volume") {
  for (int per_cell : {1, 4, 8, 27}) {
    const auto setup = build(
        "[[snow]]\nshape = \"ball\"\ncenter = [0, 1, 0]\nradius = 0.2\ndensity = 250\nparticles_per_cell = " +
        std::to_string(per_cell) + "\n[simulation]\ndx = 0.02");
    const PlacedSnow& snow = setup.snow[0];
    const double volume = 4.0 / 3.0 * M_PI * 0.008;
    CHECK(static_cast<double>(snow.position.size()) == Approx(volume / 8e-6 * per_cell).epsilon(0.02));
    CHECK(total_mass(snow) == Approx(250 * volume).epsilon(1e-12));
    CHECK(snow.particle_volume == Approx(8e-6 / per_cell).epsilon(0.02));
  }
}

TEST_CASE("boxes, cylinders and height fields have the mass of their volume") {
  const auto setup = build(
      "[[snow]]\nshape = \"box\"\ncenter = [0, 1, 0]\nsize = [0.4, 0.1, 0.3]\nrotation = [10, 20, 30]\n"
      "[[snow]]\nshape = \"cylinder\"\ncenter = [1, 1, 0]\nradius = 0.1\nheight = 0.3\n"
      "[[snow]]\nshape = \"height_field\"\nfile = \"" FIRN_SOURCE_ROOT
      "/tests/scene/flat.asc\"\noffset = [5, 0, 0]\nbase = 0.75\n[simulation]\ndx = 0.05");
  CHECK(total_mass(setup.snow[0]) == Approx(400 * 0.012));
  CHECK(total_mass(setup.snow[1]) == Approx(400 * M_PI * 0.003));
  CHECK(total_mass(setup.snow[2]) == Approx(400 * 0.25));
  for (const Vec3& p : setup.snow[2].position)
    CHECK((p.y() > 0.75 && p.y() < 1 && p.x() > 4.5 && p.x() < 5.5));
}

TEST_CASE("a sheet of one spacing is filled, not skipped") {
  const auto points = fill_shape({Box{Vec3(0.5, 0.02, 0.5)}, {}}, 0.05, 4);
  CHECK(points.size() == 400);
}

TEST_CASE("velocity is the body's own and its spin about its centre") {
  const auto setup = build(
      "[[snow]]\nshape = \"ball\"\ncenter = [1, 2, 3]\nradius = 0.1\nvelocity = [5, 0, 0]\nspin = [0, 0, 2]\n"
      "[simulation]\nparticles_across = 8");
  for (std::size_t i = 0; i < setup.snow[0].position.size(); ++i) {
    const Vec3 r = setup.snow[0].position[i] - Vec3(1, 2, 3);
    CHECK((setup.snow[0].velocity[i] - Vec3(5 - 2 * r.y(), 2 * r.x(), 0)).norm() < 1e-12);
  }
}

TEST_CASE("the same seed places the same particles, another one others, each object its own") {
  const std::string two =
      "[[snow]]\nshape = \"ball\"\ncenter = [0, 1, 0]\nradius = 0.1\n"
      "[[snow]]\nshape = \"ball\"\ncenter = [1, 1, 0]\nradius = 0.1\n[simulation]\nparticles_across = 10\n";
  const auto a = build(two), b = build(two), c = build(two + "seed = 2\n");
  CHECK(a.snow[0].position == b.snow[0].position);
  CHECK(a.snow[0].position != c.snow[0].position);
  CHECK((a.snow[1].position[0] - a.snow[0].position[0] - Vec3(1, 0, 0)).norm() > 1e-6);
}

TEST_CASE("flakes are scattered in their region, apart from one another, each with its particles") {
  const std::string text =
      "[[snow]]\nshape = \"flakes\"\ncenter = [0, 2, 0]\nsize = [1, 2, 1]\nradius = 0.02\ncount = "
      "200\ndensity = 100\n"
      "[simulation]\ndx = 0.02\n";
  const auto setup = build(text);
  CHECK(setup.snow[0].position.size() > 200 * 20);
  CHECK(total_mass(setup.snow[0]) == Approx(100 * 200 * 4.0 / 3.0 * M_PI * 8e-6));
  for (const Vec3& p : setup.snow[0].position) {
    CHECK(((p - Vec3(0, 2, 0)).cwiseAbs().array() < Vec3(0.5, 1, 0.5).array()).all());
  }
  std::string crowded = text;
  crowded.replace(crowded.find("200"), 3, "90000");
  CHECK_REFUSES(build(crowded), "of 90000 flakes fit into the region");
}

TEST_CASE("clumps have the packing of the material inside and are looser where two of them meet") {
  const auto points = fill_shape(kBall, 0.05, 5);
  const auto packing = clump_packing(points, 0.4, 0.5, 9);
  const auto [least, most] = std::minmax_element(packing.begin(), packing.end());
  CHECK(*least == 1.f);
  CHECK(*most <= 1.4f);
  CHECK(*most > 1.35f);
  const auto even = std::count(packing.begin(), packing.end(), 1.f);
  CHECK(even > static_cast<long>(packing.size()) / 4);
  CHECK(even < static_cast<long>(packing.size()) * 9 / 10);
  CHECK(packing == clump_packing(points, 0.4, 0.5, 9));
  CHECK(packing != clump_packing(points, 0.4, 0.5, 10));
}

TEST_CASE("snow without looseness starts evenly packed") {
  const std::string ball = "[[snow]]\nshape = \"ball\"\ncenter = [1, 2, 3]\nradius = 0.1\n";
  CHECK(build(ball).snow[0].packing.empty());
  const auto uneven = build(ball + "looseness = 0.2\n");
  CHECK(uneven.snow[0].packing.size() == uneven.snow[0].position.size());
}

}  // namespace firn::test::emit
