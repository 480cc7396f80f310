// SPDX-License-Identifier: MIT
// The turn of a particle, by which it carries its facets of ice, is the rotation of F, its elastic part: it
// must be that of the snow around it, also where the snow yields.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <map>

#include "src/core/rng.h"
#include "src/core/rotation.h"
#include "src/scene/presets.h"
#include "tests/catch.h"
#include "tests/physics/snow.h"

namespace firn::test::turn {
namespace {

Mat3 random_matrix(std::uint64_t key) {
  Mat3 m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = uniform_double(hash_keys(key, k)) - 0.5;
  return m;
}

// U V^T with det +1: the rotation that is nearest to m.
Mat3 nearest_rotation(const Mat3& m) {
  const Eigen::JacobiSVD<Mat3> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;
  return u * svd.matrixV().transpose();
}

double angle(const Mat3& a, const Mat3& b) {  // between two rotations, rad
  return 2 * std::asin(std::min(1.0, (a - b).norm() / std::sqrt(8.0)));
}

Mat3 turn_of(const Snapshot& s, std::size_t i) {
  return unpack_rotation({s.rotation[0][i], s.rotation[1][i], s.rotation[2][i]}).cast<double>();
}

// rad, root of the mean square over the particles: how far their turn is from the rotation that carries the
// places of the particles around them (within `near`, as placed) from `before` to `after`.
double turn_error(const Snapshot& before, const Snapshot& after, double near) {
  std::map<std::uint32_t, std::size_t> where;
  for (std::size_t i = 0; i < after.size(); ++i) where[after.id[i]] = i;
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < before.size(); i += 7) {
    Mat3 moved = Mat3::Zero();
    for (std::size_t j = 0; j < before.size(); ++j) {
      const Vec3 was = vec(before.world_position(j)) - vec(before.world_position(i));
      if (was.norm() > near) continue;
      moved +=
          (vec(after.world_position(where[before.id[j]])) - vec(after.world_position(where[before.id[i]]))) *
          was.transpose();
    }
    const double error = angle(nearest_rotation(moved), turn_of(after, where[before.id[i]]));
    sum += error * error;
    ++count;
  }
  return std::sqrt(sum / count);
}

// Of particles that are not alone: rad/s, the medians of the snow's spin around them and of how far the rate
// of their turn is from it.
struct Rates {
  double spin, error;
};

Vec3 axial(const Mat3& m) { return 0.5 * Vec3(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)); }

Rates rates(const Snapshot& now, const Snapshot& later, double near) {
  std::map<std::uint32_t, std::size_t> where;
  for (std::size_t i = 0; i < later.size(); ++i) where[later.id[i]] = i;
  std::vector<double> spin, error;
  for (std::size_t i = 0; i < now.size(); i += 5) {
    Mat3 spread = Mat3::Zero(), shear = Mat3::Zero();
    for (std::size_t j = 0; j < now.size(); ++j) {
      const Vec3 x = vec(now.world_position(j)) - vec(now.world_position(i));
      if (x.norm() > near) continue;
      const Vec3 v(now.velocity[0][j] - now.velocity[0][i], now.velocity[1][j] - now.velocity[1][i],
                   now.velocity[2][j] - now.velocity[2][i]);
      spread += x * x.transpose();
      shear += v * x.transpose();
    }
    if (spread.determinant() < 1e-20) continue;
    const Vec3 around = axial(shear * spread.inverse());
    const Mat3 turned = turn_of(later, where[now.id[i]]) * turn_of(now, i).transpose();
    spin.push_back(around.norm());
    error.push_back((axial(turned) / (later.time - now.time) - around).norm());
  }
  const auto median = [](std::vector<double>& of) {
    std::nth_element(of.begin(), of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2), of.end());
    return of[of.size() / 2];
  };
  return {median(spin), median(error)};
}

double mean_angle(const Snapshot& s) {
  double sum = 0;
  for (std::size_t i = 0; i < s.size(); ++i) sum += angle(Mat3::Identity(), turn_of(s, i));
  return sum / static_cast<double>(s.size());
}

}  // namespace

TEST_CASE("the polar rotation is the nearest one, and six bytes hold it to 1.1e-4", "[light]") {
  double worst = 0;
  for (std::uint64_t k = 0; k < 3000; ++k) {
    const Mat3 r = nearest_rotation(random_matrix(k));
    REQUIRE((polar_rotation(r) - r).norm() < 1e-12);
    Mat3 f = r * (Mat3::Identity() + 0.8 * random_matrix(k + 5000));
    if (f.determinant() < 0.05) continue;
    REQUIRE((polar_rotation(f) - nearest_rotation(f)).norm() < 1e-7);
    worst = std::max(worst, angle(r, unpack_rotation(pack_rotation(r)).cast<double>()));
  }
  CHECK(worst < 1.1e-4);
  CHECK(worst > 3e-5);
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0.6, 0, -0.8)}) {
    for (const double by : {0.0, 1e-3, 1.0, 3.1, M_PI, 4.0, 2 * M_PI - 1e-3}) {
      const Mat3 r = Eigen::AngleAxisd(by, axis).toRotationMatrix();
      REQUIRE((unpack_rotation(pack_rotation(r)).cast<double>() - r).norm() < 2e-4);
    }
  }
  CHECK(pack_rotation(Mat3::Identity()) == PackedRotation{0, 0, 0});
  CHECK(unpack_rotation({0, 0, 0}) == Eigen::Matrix3f::Identity());
  CHECK(polar_rotation(Mat3::Zero()) == Mat3::Identity());
  CHECK(polar_rotation(-Mat3::Identity()) == Mat3::Identity());
}

TEST_CASE("particles of a spinning elastic ball turn with it", "[light]") {
  SolverSetup setup;
  setup.dx = 0.02;
  setup.gravity = Vec3::Zero();
  setup.snow.push_back(ball(Vec3::Zero(), 0.1, setup.dx, elastic(), Vec3::Zero()));
  const Vec3 omega = Vec3(3, -8, 5);
  for (std::size_t i = 0; i < setup.snow[0].position.size(); ++i)
    setup.snow[0].velocity[i] = omega.cross(setup.snow[0].position[i]);
  Solver simulation(best_kernels(), setup);
  Snapshot before, after;
  simulation.snapshot(before);
  simulation.advance_to(0.2);
  simulation.snapshot(after);
  CHECK(mean_angle(before) == 0);
  CHECK(mean_angle(after) == Approx(0.2 * omega.norm()).epsilon(0.03));
  CHECK(turn_error(before, after, 0.3) < 0.05);
}

TEST_CASE("particles turn with snow that yields as it rolls and falls apart", "[light]") {
  for (const char* name : {"wet", "fresh", "powder"}) {
    SolverSetup setup;
    setup.dx = 0.03;
    setup.gravity = 9.81 * Vec3(0.5, -0.866, 0);
    PlacedSnow snow = ball(Vec3(0, 0.16, 0), 0.15, setup.dx, find_preset(name).material, Vec3(1.5, 0, 0));
    for (std::size_t i = 0; i < snow.position.size(); ++i)
      snow.velocity[i] += Vec3(0, 0, -10).cross(snow.position[i] - Vec3(0, 0.16, 0));
    setup.snow.push_back(std::move(snow));
    setup.colliders.push_back(plane(Vec3::Zero(), Vec3(0, 1, 0), Contact::separating, 1.0));
    Solver simulation(best_kernels(), setup);
    Snapshot before, after, later;
    simulation.snapshot(before);
    simulation.advance_to(0.3);
    simulation.snapshot(after);
    simulation.advance_to(0.302);
    simulation.snapshot(later);
    // Yielding changes the stretch of F, not its rotation: it takes up the spin of the snow, 15 rad/s here.
    const Rates r = rates(after, later, 1.6 * setup.dx);
    INFO(name << ": turned by " << mean_angle(after) << ", spin " << r.spin << " 1/s, error " << r.error);
    CHECK(mean_angle(after) > 2);
    CHECK(r.error < 0.06 * r.spin);
    // Powder has fallen apart: its particles have other neighbours now.
    if (name != std::string("powder")) CHECK(turn_error(before, after, 1.6 * setup.dx) < 0.03);
  }
}

}  // namespace firn::test::turn
