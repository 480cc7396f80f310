// SPDX-License-Identifier: MIT
// Relief of close-ups: a particle drawn as a heap is the same snow, only rougher, and carries its heap along.
#include <Eigen/Geometry>
#include <set>

#include "src/core/isa.h"
#include "src/core/rng.h"
#include "src/core/rotation.h"
#include "src/render/sampling/directions.h"
#include "src/render/snow/relief.h"
#include "src/render/snow/snow_field.h"
#include "tests/catch.h"
#include "tests/light/pictures.h"

using namespace firn;

TEST_CASE("a heap has the volume, object and motion of its particle and lies around it", "[light]") {
  Snapshot snow = test::snowball(Vec3(1, 2, 3), 0.05, 0.01, Vec3(1, 1, 1));
  snow.velocity[1][7] = 3;
  snow.object[7] = 4;
  for (const int detail : {1, 2, 3}) {
    const Snapshot fine = with_relief(snow, detail);
    const std::size_t parts = static_cast<std::size_t>(detail) * detail * detail;
    REQUIRE(fine.size() == parts * snow.size());
    CHECK(fine.origin == snow.origin);
    Vec3 off = Vec3::Zero();
    for (std::size_t i = 0; i < snow.size(); ++i) {
      double volume = 0;
      for (std::size_t k = i * parts; k < (i + 1) * parts; ++k) {
        const Vec3 from = vec(fine.world_position(k)) - vec(snow.world_position(i));
        REQUIRE(from.cwiseAbs().maxCoeff() < 0.0076);
        off += from;
        volume += fine.volume0[k];
        REQUIRE(fine.velocity[1][k] == snow.velocity[1][i]);
        REQUIRE(fine.object[k] == snow.object[i]);
        REQUIRE(fine.density[k] == snow.density[i]);
      }
      REQUIRE(volume == Approx(snow.volume0[i]).epsilon(1e-5));
    }
    const auto count = static_cast<double>(fine.size());
    CHECK((off / count).norm() < 4 * 0.0075 / std::sqrt(2.0 * count));  // the tent's deviation is 0.0031
    CHECK(std::set<std::uint32_t>(fine.id.begin(), fine.id.end()).size() > 0.999 * count);
  }
}

TEST_CASE("a heap turns with its particle", "[light]") {
  Snapshot snow = test::snowball(Vec3::Zero(), 0.03, 0.01, Vec3::Zero());
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(2, -1, 2) / 3).toRotationMatrix();
  Snapshot turned = snow;
  const PackedRotation packed = pack_rotation(turn);
  for (std::size_t i = 0; i < snow.size(); ++i) {
    const Vec3 x = turn * vec(snow.world_position(i));
    for (int a = 0; a < 3; ++a) {
      turned.position[a][i] = static_cast<float>(x[a]);
      turned.rotation[a][i] = packed[a];
    }
  }
  const Snapshot fine = with_relief(snow, 2), fine_turned = with_relief(turned, 2);
  CHECK(fine.id == fine_turned.id);
  CHECK(fine.volume0 == fine_turned.volume0);
  for (std::size_t i = 0; i < fine.size(); ++i) {
    REQUIRE((vec(fine_turned.world_position(i)) - turn * vec(fine.world_position(i))).norm() < 2e-6);
    REQUIRE(fine_turned.rotation[0][i] == packed[0]);
  }
}

TEST_CASE("relief roughens the surface of a ball and keeps its mass, and its volume to 3 %", "[light]") {
  const double radius = 0.05, spacing = 0.0025;
  const std::vector<SnowLook> looks(1);
  double roughness[4] = {};
  for (const int detail : {1, 2, 3}) {
    const Snapshot snow = with_relief(test::snowball(Vec3::Zero(), radius, spacing, Vec3::Zero()), detail);
    const kernels::TraceKernels& kernels = supported_kernels().back()->trace;
    RenderGrid grid(kernels);
    grid.build(snow, looks, true);
    SnowField field(kernels);
    field.build(grid, snow, looks);
    double mass = 0;
    for (const float v : snow.volume0) mass += 400.0 * v;
    CHECK(field.mass() == Approx(mass).epsilon(1e-4));
    // Along rays from the middle, the last place that is filled to a half.
    double sum = 0, sum2 = 0, cube = 0;
    const int rays = 4000;
    for (int k = 0; k < rays; ++k) {
      const Vec3f d = cosine_direction(k % 2 ? Vec3f(0, 1, 0) : Vec3f(0, -1, 0),
                                       {uniform_float(hash_keys(1, k)), uniform_float(hash_keys(2, k))});
      double r = 1.2 * radius;
      while (r > 0 && field.fill((d.cast<double>() * r - grid.origin()).cast<float>()) < 0.5f)
        r -= 0.02 * spacing;
      sum += r, sum2 += r * r, cube += r * r * r;
    }
    roughness[detail] = std::sqrt(sum2 / rays - (sum / rays) * (sum / rays)) / spacing;
    CHECK(cube / rays == Approx(radius * radius * radius).epsilon(0.03));
  }
  INFO("RMS in spacings: " << roughness[1] << ", " << roughness[2] << ", " << roughness[3]);
  CHECK(roughness[1] < 0.2);
  CHECK(roughness[2] > 1.2 * roughness[1]);
  CHECK(roughness[3] > roughness[2]);
  CHECK(roughness[3] < 0.5);
}
